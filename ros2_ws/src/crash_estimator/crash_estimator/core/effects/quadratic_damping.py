"""Quadratic damping: F = c V |V|, as of a fluid or of air pressed out of a padding.

V is the rate of crush in m/s, compression positive; c in N s^2/m^2, never negative.
"""

import numpy as np

from .base import ElementForce, ElementMotion


def force(motion: ElementMotion):
    return motion.rate * np.abs(motion.rate)


EFFECT = ElementForce("quadratic_damping", "N*s^2/m^2", force=force)
