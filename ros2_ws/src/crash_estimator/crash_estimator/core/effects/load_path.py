"""A load path: a linear spring between two bodies that no spring of the model joins, F = c X, both ways.

X = x_a - x_b in m, counted from their distance at time zero; c in N/m, never negative. Form `late`: a part that is
reached on the way, F = c (X - gap) where that is positive; `late_back`: where b runs into a from behind.
"""

from .base import PairSpring, Shape

EFFECT = PairSpring("load_path", "N/m", {"gap": Shape("m", 1e-3, 0.5, (0.1,))})
"""Limits of the gap: below, it carries from the beginning; above, nothing of a car is left to be reached. Where
it is not stated, it starts as given here; it is searched for from shares of how close the bodies come."""
