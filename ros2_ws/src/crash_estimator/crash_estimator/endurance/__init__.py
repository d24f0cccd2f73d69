"""Long runs: a million samples through every method, 500 tests through every node; nothing may grow or decay."""
