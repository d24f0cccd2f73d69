"""`estimator`: follows the replayed samples with one model and one method, and publishes what it finds.

Subscribes to `test` and `samples`, or to `channels/<name>` where rosbag2's player plays the bag; publishes
`~/parameters` and `~/residuals` by name, the same in blocks on `~/block/parameters` and `~/block/residuals`,
`~/forces`, `~/events` and `~/state`, and answers on `answers` what it has done with.
Several run side by side under different names (`--ros-args -r __node:=mrls`). The settings below are those of
its default method; the README has those of the others.
"""

import sys

from crash_replay.node_program import node_program

from .estimator_parameters import table_for

PARAMETERS = table_for({})


def main() -> int:
    return node_program("estimator", __doc__, PARAMETERS, "crash_estimator.nodes.estimator_node")


if __name__ == "__main__":
    sys.exit(main())
