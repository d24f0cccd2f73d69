"""`replay`: publishes a recording at its sample rate times `rate`, under control by services."""

import sys

from .node_program import node_program
from .replay_parameters import PARAMETERS


def main() -> int:
    return node_program("replay", __doc__, PARAMETERS, "crash_replay.replay_node")


if __name__ == "__main__":
    sys.exit(main())
