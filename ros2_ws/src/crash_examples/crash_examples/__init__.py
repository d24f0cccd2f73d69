"""Nodes as another author would write them: they know crash_msgs and the README, and nothing of our Python."""
