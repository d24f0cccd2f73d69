"""Following a test as it is replayed: forward, back, in jumps and in blocks. No ROS here."""
