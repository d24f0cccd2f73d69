"""Rate hardening (Cowper-Symonds): the static force times 1 + (V / D)^(1/q) while V > 0.

V is the rate of crush in m/s; D, the rate that doubles the force, in m/s, is the coefficient; the exponent q is
found. The fit works with c = D^(-1/q), in which the force is linear: c = 0 is no hardening, D infinite.
"""

import numpy as np

from .base import Shape, StaticFactor


def factor(rate: np.ndarray, exponent: float) -> np.ndarray:
    return np.maximum(rate, 1e-9) ** (1.0 / exponent) * (rate > 0.0)


def stated(c: float, exponent: float) -> float:
    return c**-exponent if c > 0.0 else np.inf


def unstated(value: float, exponent: float) -> float:
    return value ** (-1.0 / exponent)


EFFECT = StaticFactor(
    "rate_hardening",
    "m/s",
    {"exponent": Shape("", 0.7, 10.0, (1.0, 3.0))},
    factor=factor,
    stated=stated,
    unstated=unstated,
)
