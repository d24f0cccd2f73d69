"""Measured figures of the whole: which hidden effects are found, and what everything costs."""
