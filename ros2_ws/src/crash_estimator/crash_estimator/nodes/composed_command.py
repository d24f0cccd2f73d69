"""`composed`: a replay and estimators in one process.

    tools/run crash_estimator composed NAME [NAME ...] --ros-args -p replay:bag:=BAG -p NAME:model:=MODEL

Each node has its parameters behind its name and a colon, whatever its namespace. It is one process to start, watch and
end instead of several; what its nodes say goes through the middleware all the same, and one thread computes at a time.
It ends when the replay is over and everybody has said the last word.
"""

import sys

from crash_replay.node_program import node_program


def main() -> int:
    return node_program("composed NAME [NAME ...]", __doc__, {}, "crash_estimator.nodes.composed")


if __name__ == "__main__":
    sys.exit(main())
