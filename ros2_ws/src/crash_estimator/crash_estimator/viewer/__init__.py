"""Rerun live: arrays in, a recording and its layout out. No ROS here; the node hands arrays over."""
