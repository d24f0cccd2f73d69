"""Dry friction of a body on the ground, a guide or a rail: F = -c tanh(v / speed), against the body's own motion.

v is the body's velocity in m/s; c in N, never negative; the smoothing speed is that of `coulomb_friction`, of the
body's largest speed.
"""

from . import coulomb_friction
from .kinds import GuideForce

EFFECT = GuideForce(
    "guide_friction",
    "N",
    coulomb_friction.EFFECT.shapes,
    force=coulomb_friction.force,
    of_rate_only=True,
    rare=True,
)
