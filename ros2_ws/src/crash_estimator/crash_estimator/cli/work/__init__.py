"""What the commands do once their lines are understood, one file each."""
