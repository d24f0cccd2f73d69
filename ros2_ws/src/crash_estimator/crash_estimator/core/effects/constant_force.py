"""A constant force on a body from time zero on, such as braking, tyre friction or a hill: M a = sum of forces + c.

c in N, positive in the travel direction; either sign. Form `rising`: in proportion to the time until t = rise, as the
push of an air bag or of a belt does: c min(t / rise, 1).
"""

import numpy as np

from .base import BodyForce, Shape


def force(time, rise=None):
    return np.ones_like(time) if rise is None else np.clip(time / rise, 0.0, 1.0)


EFFECT = BodyForce(
    "constant_force",
    "N",
    shapes={"rise": Shape("s", 0.5e-3, 0.05, (0.003, 0.012))},  # an air bag takes 5 to 30 ms, a shock no time
    force=force,
    low=-np.inf,
    rises=True,
)
