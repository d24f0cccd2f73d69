"""The ROS nodes: declare, convert, step, convert, publish."""
