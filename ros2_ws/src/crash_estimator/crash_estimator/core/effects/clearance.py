"""Clearance: the element carries nothing until its crush exceeds a gap, and no tension; its crush counts from there.

    F = F_element(X - gap)  where X > gap,  else 0

Form `play`, of an element that carries both ways: F = F_element(X + gap) where X < - gap as well.

The coefficient is the gap in m.
"""

from .base import Gap

EFFECT = Gap("clearance", "m")
