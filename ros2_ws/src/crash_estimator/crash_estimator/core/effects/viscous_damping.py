"""Viscous damping: F = c V, in parallel to the element's spring (thesis equation 4.1).

V is the rate of crush in m/s, compression positive; c in N s/m, never negative: a damper takes energy out.

Form `uneven`, of a damper with valves, as those of vehicles are: F = c V where V > 0, F = c rebound V where V < 0.
With a check valve, which lets the fluid flow back freely, `rebound` is next to nothing. It takes the place of a damping
of the element that is estimated: of both together no recording tells c.

Form `hunt_crossley`, of two bodies that touch, whose surface of contact grows as they press (Hunt and Crossley 1975,
equation 9): F = c (|X| / 0.1 m)^exponent V, X the crush in m: c is that of a crush of 0.1 m. Damping so begins and ends
a contact without a jump; with the exponent of the spring's own law, X^exponent, it is a share of the spring's force.

Form `power`, of a damper whose orifices open with the pressure, as shock absorbers and seismic dampers are: F = c V
|V / (1 m/s)|^(power - 1); c is that of a rate of 1 m/s (Constantinou and Symans 1992, NCEER-92-0032).
"""

import numpy as np

from .base import ElementForce, ElementMotion, Shape

OF_CRUSH = 0.1
"""m, that the coefficient is stated at: between the crush of a padding and that of a car's front."""

AT_REST = 0.01
"""m/s, below which a power is a line: a slope without bounds at rest is no physics, and no motion dwells there."""


def force(motion: ElementMotion, rebound: float = 1.0, exponent: float = 0.0, power: float = 1.0):
    grown = (np.abs(motion.crush) / OF_CRUSH) ** exponent if exponent else 1.0
    bent = np.hypot(motion.rate, AT_REST) ** (power - 1.0) if power != 1.0 else 1.0
    return np.where(motion.rate < 0.0, rebound, 1.0) * grown * bent * motion.rate


EFFECT = ElementForce(
    "viscous_damping",
    "N*s/m",
    {
        "rebound": Shape("", 1e-3, 5.0, (0.1, 3.0)),
        "exponent": Shape("", 0.2, 2.0, (1.0,)),
        "power": Shape("", 0.4, 1.8, (0.7,)),
    },
    force=force,
    doubles="damping",
    includes=("uneven",),
    forms={"": (), "uneven": ("rebound",), "hunt_crossley": ("exponent",), "power": ("power",)},
)
"""Limits of the rebound: a thousandth is nothing; the dampers of cars pull up to five times as hard as they push.
It is sought from both sides of 1: from a tenth alone none of six simulated dampers with 2 and 4 was told.
Of the exponent: laws of contact have 1/4 (Tsuji and others 1992), 1/2, 1 and 3/2 (Hunt and Crossley);
above 2 a gas that leaks was told as this in one looked-at case. Of the power: at 0 it is
dry friction, which in loud noise was told as this from 0.3 on in one of 125 looked-at cases; at 2 it is quadratic."""
