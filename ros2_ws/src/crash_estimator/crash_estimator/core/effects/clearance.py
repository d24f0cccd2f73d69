"""Clearance: the element carries nothing until its crush exceeds a gap, and no tension; its crush counts from there.

    F = F_element(X - gap)  where X > gap,  else 0

The coefficient is the gap in m.
"""

from .base import Gap

EFFECT = Gap("clearance", "m")
