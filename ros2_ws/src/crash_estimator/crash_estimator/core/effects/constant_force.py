"""A constant force on a body from time zero on, such as braking, tyre friction or a hill: M a = sum of forces + c.

c in N, positive in the travel direction; either sign.
"""

import numpy as np

from .base import BodyForce


def force(time):
    return np.ones_like(time)


EFFECT = BodyForce("constant_force", "N", force=force, low=-np.inf)
