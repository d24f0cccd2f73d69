"""`diagnosis`: says, while a test is replayed, which physical effect the model lacks, and where it fails.

Subscribes to `test` and `samples` (or `channels/<name>`, from rosbag2's player); publishes `~/ranking`, `~/misfit` and
`~/revisions` as the samples come, and after the last one the offline answer. Adding an effect, or taking one out, makes
a new revision of its model, and the same question is asked of it on the samples that are kept.
"""

import sys

from crash_replay.node_program import node_program

from .diagnosis_parameters import PARAMETERS


def main() -> int:
    return node_program("diagnosis", __doc__, PARAMETERS, "crash_estimator.nodes.diagnosis_node")


if __name__ == "__main__":
    sys.exit(main())
