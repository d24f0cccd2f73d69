"""Commands without a ROS graph, one file each: its command line."""
