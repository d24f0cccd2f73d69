"""Hardening spring: F = c X^3 in parallel to the element's own spring.

X is the crush in m, compression positive; c in N/m^3, never negative. A free curve of an elastic element
contains it, so it is offered where the element's stiffness is one constant or known, or unloads along a line.
Form `in_curve`: it is a part of that spring's own curve, and unloads along the same line.
"""

from .base import ElementForce, ElementMotion


def force(motion: ElementMotion):
    return motion.crush**3


EFFECT = ElementForce("cubic_stiffness", "N/m^3", force=force, of_crush_only=True)
