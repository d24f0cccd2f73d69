"""A stop: F = c (X - stop) where the crush X exceeds `stop`, in parallel to the element's own spring.

X in m, compression positive; c in N/m, never negative; where the stop sits is found. A free curve of an elastic
element contains it, so it is offered where the element's stiffness is one constant or known, or unloads along a line.
Form `in_curve`: it is a part of that spring's own curve, and unloads along the same line.
"""

import numpy as np

from .base import ElementForce, ElementMotion, Shape


def force(motion: ElementMotion, stop: float):
    return np.maximum(motion.crush - stop, 0.0)


EFFECT = ElementForce(
    "bottoming_out",
    "N/m",
    {"stop": Shape("m", 0.05, 0.97, (0.2, 0.35, 0.5, 0.6, 0.7, 0.8, 0.9), of_crush=True)},
    force=force,
    of_crush_only=True,
)
