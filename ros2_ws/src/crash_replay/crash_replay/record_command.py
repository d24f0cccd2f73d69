"""`record`: writes what replay, estimators and diagnosis publish into an MCAP file, which is readable at every instant.

    ros2 run crash_replay record --ros-args -p to:=estimates.mcap -p wait_for:=2

It listens to `samples` as soon as it hears `wait_for` estimators, so a replay that waits for it begins when all else is
heard. It ends when the replay has gone and everybody has said the last word, or by a signal, and says whether the
recording is complete: on the terminal, in the file and by its exit status. What it has missed itself it asks for.
"""

import sys

from .node_program import node_program
from .record_parameters import PARAMETERS


def main() -> int:
    return node_program("record", __doc__, PARAMETERS, "crash_replay.record_node")


if __name__ == "__main__":
    sys.exit(main())
