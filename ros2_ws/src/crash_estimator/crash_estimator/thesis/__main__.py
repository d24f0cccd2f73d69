"""`python -m crash_estimator.thesis`: the thesis's experiments run again, docs/thesis.md."""

from .page import main

main()
