"""`diagnosis`: says, while a test is replayed, which physical effect the model lacks, and where it fails.

Subscribes to `test` and `samples` (or `channels/<name>`, from rosbag2's player); publishes `~/ranking`, `~/misfit` and
`~/revisions` as the samples come, and after the last one the offline answer. Adding an effect, or taking one out, makes
a new revision of its model, and the same question is asked of it on the samples that are kept.
"""

import sys

from crash_replay.node_parameters import NAME, Allowed
from crash_replay.node_program import node_program

from ..ready_models import MODEL

PARAMETERS = {
    "model": Allowed("", MODEL, needed=f"give {MODEL}"),
    "with_bags": Allowed([""], "other recordings of the same structure, used with the replayed one"),
    "effects": Allowed("", "your own effects, a .py file; it is executed"),
    "every": Allowed(0.002, "s of the crash between two rankings", 1e-5, 1e4),
    "add_first": Allowed(False, "add the first effect that a final answer names, once; none where it is unexplained"),
    "estimators": Allowed([""], "names of estimators that it is added to as well", pattern=NAME),
    "replay": Allowed("replay", "node that samples are asked of which were missed", pattern=NAME),
}


def main() -> int:
    return node_program("diagnosis", __doc__, PARAMETERS, "crash_estimator.nodes.diagnosis_node")


if __name__ == "__main__":
    sys.exit(main())
