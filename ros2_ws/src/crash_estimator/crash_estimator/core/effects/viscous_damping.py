"""Viscous damping: F = c V, in parallel to the element's spring (thesis equation 4.1).

V is the rate of crush in m/s, compression positive; c in N s/m, never negative: a damper takes energy out.

Form `uneven`, of a damper with valves, as those of vehicles are: F = c V where V > 0, F = c rebound V where V < 0.
With a check valve, which lets the fluid flow back freely, `rebound` is next to nothing.

Form `hunt_crossley`, of two bodies that touch, whose surface of contact grows as they press (Hunt and Crossley 1975,
equation 9): F = c (|X| / 0.1 m)^exponent V, X the crush in m: c is that of a crush of 0.1 m. Damping so begins and ends
a contact without a jump; with the exponent of the spring's own law, X^exponent, it is a share of the spring's force.
"""

import numpy as np

from .base import ElementForce, ElementMotion, Shape

OF_CRUSH = 0.1
"""m, that the coefficient is stated at: between the crush of a padding and that of a car's front."""


def force(motion: ElementMotion, rebound: float = 1.0, exponent: float = 0.0):
    grown = (np.abs(motion.crush) / OF_CRUSH) ** exponent if exponent else 1.0
    return np.where(motion.rate < 0.0, rebound, 1.0) * grown * motion.rate


EFFECT = ElementForce(
    "viscous_damping",
    "N*s/m",
    {"rebound": Shape("", 1e-3, 5.0, (0.1,)), "exponent": Shape("", 0.2, 2.0, (1.0,))},
    force=force,
    doubles="damping",
    forms={"": (), "uneven": ("rebound",), "hunt_crossley": ("exponent",)},
)
"""Limits of the rebound: a thousandth is nothing; the dampers of cars pull up to five times as hard as they push.
Of the exponent: laws of contact have 1/4 (Tsuji and others 1992), 1/2, 1 and 3/2 (Hunt and Crossley);
above 2 a gas that leaks was told as this in one looked-at case."""
