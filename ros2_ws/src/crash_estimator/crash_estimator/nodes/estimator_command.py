"""`estimator`: follows the replayed samples with one model and one method, and publishes what it finds.

Subscribes to `test` and `samples`, or to `channels/<name>` where rosbag2's player plays the bag; publishes
`~/parameters` and `~/residuals` by name, the same in blocks on `~/block/parameters` and `~/block/residuals`,
`~/forces`, `~/events` and `~/state`, and answers on `answers` what it has done with.
Several run side by side under different names (`--ros-args -r __node:=mrls`).
"""

import sys

from crash_replay.node_parameters import NAME, Allowed
from crash_replay.node_program import node_program

from ..core.methods import METHODS
from ..ready_models import MODEL

PARAMETERS = {
    "model": Allowed("", MODEL, needed=f"give {MODEL}"),
    "method": Allowed("constrained_kalman", f"one of {', '.join(METHODS)}"),
    "settings": Allowed([""], "settings of the method, such as forgetting=0.98"),
    "effects": Allowed("", "your own effects, a .py file; it is executed"),
    "effective_mass": Allowed(False, "find the masses that go with the accelerometers first"),
    "value_topics": Allowed([""], "parameters that get a topic of their own, names or patterns such as *.stiffness"),
    "replay": Allowed("replay", "node that samples are asked of which were missed", pattern=NAME),
}


def main() -> int:
    return node_program("estimator", __doc__, PARAMETERS, "crash_estimator.nodes.estimator_node")


if __name__ == "__main__":
    sys.exit(main())
