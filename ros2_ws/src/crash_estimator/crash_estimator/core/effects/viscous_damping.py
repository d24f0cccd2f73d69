"""Viscous damping: F = c V, in parallel to the element's spring (thesis equation 4.1).

V is the rate of crush in m/s, compression positive; c in N s/m, never negative: a damper takes energy out.
"""

from .base import ElementForce, ElementMotion


def force(motion: ElementMotion):
    return motion.rate


EFFECT = ElementForce("viscous_damping", "N*s/m", force=force, doubles="damping", of_rate_only=True)
