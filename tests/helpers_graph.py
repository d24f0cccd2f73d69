"""Which files of tests start nodes or other processes."""

import re

NEEDS_A_GRAPH = re.compile(
    r"\b(rclpy|crash_msgs|subprocess|stage|node_ended)\b|helpers_(demo|diagnosis|domain|estimator_node|nodes|other_process|record|replay|service|waiting)"
)
"""What a file of tests mentions that starts nodes or other processes."""
