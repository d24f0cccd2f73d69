"""`viewer`: shows what the estimators say in Rerun, live, and writes it to a .rrd file.

Subscribes to `test`, each estimator's `block/parameters`, `block/residuals`, `forces` and `events`, and the diagnosis'
`ranking`, `misfit` and `revisions`. Callbacks only queue what comes; decoding, drawing and waiting for a slow screen
happen in the recorder's own thread. What it has missed itself it asks the estimators for; what it lacks in the end it
says on the terminal, in the file and by its exit status.
"""

import sys

from crash_replay.node_program import node_program

from .viewer_parameters import PARAMETERS


def main() -> int:
    return node_program("viewer", __doc__, PARAMETERS, "crash_estimator.nodes.viewer_node")


if __name__ == "__main__":
    sys.exit(main())
