"""A load path: a linear spring between two bodies that the model does not join, F = c X, both ways.

X = x_a - x_b in m, counted from their distance at time zero; c in N/m, never negative.
"""

from .base import PairSpring

EFFECT = PairSpring("load_path", "N/m")
