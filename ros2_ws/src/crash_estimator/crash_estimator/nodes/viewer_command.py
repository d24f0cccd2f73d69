"""`viewer`: shows what the estimators say in Rerun, live, and writes it to a .rrd file.

Subscribes to `test`, each estimator's `block/parameters`, `block/residuals`, `forces` and `events`, and the diagnosis'
`ranking`, `misfit` and `revisions`. Callbacks only queue what comes; decoding, drawing and waiting for a slow screen
happen in the recorder's own thread. What it has missed itself it asks the estimators for; what it lacks in the end it
says on the terminal, in the file and by its exit status.
"""

import sys

from crash_replay.node_parameters import NAME, Allowed
from crash_replay.node_program import node_program

PARAMETERS = {
    "estimators": Allowed([""], "names of estimators; empty: all there are", pattern=NAME),
    "models": Allowed([""], "files of models other than the ready ones, for the validation"),
    "port": Allowed(9876, "of the gRPC server on 127.0.0.1 that viewers connect to; 0: a free one", 0, 65_535),
    "rrd": Allowed("crash.rrd", "file that the recording is written to; empty: none"),
    "memory_limit": Allowed(
        "1GiB",
        "what the server keeps for viewers that come late, such as 500MB or 10%",
        pattern=r"\d{1,6}(%|[kMGT]i?B|B)",
    ),
    "open": Allowed(True, "open the native viewer where there is a display"),
    "exit_when_finished": Allowed(False, "end with the replay"),
}


def main() -> int:
    return node_program("viewer", __doc__, PARAMETERS, "crash_estimator.nodes.viewer_node")


if __name__ == "__main__":
    sys.exit(main())
