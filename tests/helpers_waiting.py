"""How long a test waits for what should come at once."""

PATIENCE = 60.0
"""s; only what hangs takes so long, also where many other processes want the processor."""
