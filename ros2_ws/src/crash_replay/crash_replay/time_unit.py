"""Of time in recordings and on the wire: ns."""

SECOND = 1_000_000_000
"""ns."""
