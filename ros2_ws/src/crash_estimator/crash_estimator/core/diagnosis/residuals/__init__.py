"""What a fit leaves: the band test, the score test for what varies with time, windows of misfit."""
