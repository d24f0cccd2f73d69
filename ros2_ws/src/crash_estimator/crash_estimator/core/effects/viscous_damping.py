"""Viscous damping: F = c V, in parallel to the element's spring (thesis equation 4.1).

V is the rate of crush in m/s, compression positive; c in N s/m, never negative: a damper takes energy out.

Form `uneven`, of a damper with valves, as those of vehicles are: F = c V where V > 0, F = c rebound V where V < 0.
With a check valve, which lets the fluid flow back freely, `rebound` is next to nothing.
"""

import numpy as np

from .base import ElementForce, ElementMotion, Shape


def force(motion: ElementMotion, rebound: float = 1.0):
    return np.where(motion.rate < 0.0, rebound, 1.0) * motion.rate


EFFECT = ElementForce(
    "viscous_damping",
    "N*s/m",
    {"rebound": Shape("", 1e-3, 5.0, (0.1,))},
    force=force,
    doubles="damping",
    of_rate_only=True,
    forms={"": (), "uneven": ("rebound",)},
)
"""Its limits: a thousandth is nothing; the dampers of cars pull up to five times as hard as they push."""
