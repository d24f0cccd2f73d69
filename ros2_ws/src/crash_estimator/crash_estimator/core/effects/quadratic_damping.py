"""Quadratic damping: F = c V |V|, as of a fluid or of air pressed out of a padding.

V is the rate of crush in m/s, compression positive; c in N s^2/m^2, never negative.

Form `metered`, of a buffer with a metering pin, whose orifice closes with its travel: F = c V |V| / (1 - X / stroke)^2.
X is the crush in m, compression positive; the stroke, at which it would be closed and which no crush reaches, is found.

Form `uneven`, as of `viscous_damping`: F = c V |V| where V > 0, F = c rebound V |V| where V < 0.
"""

import numpy as np

from . import viscous_damping
from .base import ElementForce, ElementMotion, Shape


def force(motion: ElementMotion, stroke: float = np.inf, rebound: float = 1.0):
    left = np.maximum(1.0 - np.maximum(motion.crush, 0.0) / stroke, SMALLEST_OPENING)
    return viscous_damping.force(motion, rebound) * np.abs(motion.rate) / left**2


SMALLEST_OPENING = 0.01
"""Share of the orifice: a stroke that is searched for may be passed by a motion that is not yet right."""

EFFECT = ElementForce(
    "quadratic_damping",
    "N*s^2/m^2",
    {
        "stroke": Shape("m", 1.05, 5.0, (1.3, 2.5), of_crush=True),
        "rebound": viscous_damping.EFFECT.shapes["rebound"],
    },
    force=force,
    forms={"": (), "metered": ("stroke",), "uneven": ("rebound",)},
)
