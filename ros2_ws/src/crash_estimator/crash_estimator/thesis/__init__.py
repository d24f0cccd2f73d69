"""The simulated experiments of the thesis, run again: its tables beside ours in one page, docs/thesis.md."""
