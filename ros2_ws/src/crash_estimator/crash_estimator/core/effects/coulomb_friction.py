"""Dry friction: F = c tanh(V / speed), a constant force against the motion.

V is the rate of crush in m/s, compression positive; c in N, never negative. The smoothing speed, at which
friction has reached three quarters of its force, is found: up to 1 m/s, and a fifth of the largest rate of crush, as
what rises with the rate beyond that is a damper.

Form `sliding`, of two bodies of which one slides on the other, as an occupant on a seat: also where the element between
them is apart.
"""

import numpy as np

from .base import ElementMotion, Shape, SlidingForce


def force(motion: ElementMotion, speed: float):
    return np.tanh(motion.rate / speed)


EFFECT = SlidingForce(
    "coulomb_friction",
    "N",
    {"speed": Shape("m/s", 0.01, 1.0, (0.5,), of_rate=True)},
    force=force,
    of_rate_only=True,
    forms={"": ("speed",), "sliding": ("speed",)},
)
