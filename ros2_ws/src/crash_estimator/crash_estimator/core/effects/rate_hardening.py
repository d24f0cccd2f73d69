"""Rate hardening: the static force times 1 + c h(V) while V > 0; V is the rate of crush in m/s.

    h = V^(1/q)             Cowper and Symonds 1957; the exponent q is found
    h = ln(V / V0) >= 0     form `logarithmic`, Johnson and Cook 1983; the reference rate V0 in m/s is found

Forms `uneven` and `uneven_logarithmic`, as of laws that are written in |V|: on the way back, where V < 0, the factor is
1 + c rebound h(-V). With a `rebound` of 1 the force is as much larger whichever way the element moves.

The coefficient is D, the rate in m/s that doubles the force: 1 + (V / D)^(1/q), or 1 + ln(V / V0) / ln(D / V0). The
fit works with c, in which the force is linear: c = 0 is no hardening, D infinite.
"""

from dataclasses import dataclass

import numpy as np

from ..structure import ModelError
from .base import Shape, StaticFactor


def factor(
    rate: np.ndarray, exponent: float | None = None, reference_rate: float | None = None, rebound: float = 0.0
) -> np.ndarray:
    way, speed = np.where(rate > 0.0, 1.0, rebound), np.abs(rate)
    if reference_rate is not None:
        return way * np.log(np.maximum(speed / reference_rate, 1.0))
    return way * np.maximum(speed, 1e-9) ** (1.0 / exponent)


def stated(c: float, exponent: float | None = None, reference_rate: float | None = None, rebound: float = 0.0) -> float:
    if c <= 0.0:
        return np.inf
    if reference_rate is not None:
        with np.errstate(over="ignore"):
            return float(reference_rate * np.exp(1.0 / c))
    return c**-exponent


def unstated(
    value: float, exponent: float | None = None, reference_rate: float | None = None, rebound: float = 0.0
) -> float:
    if reference_rate is None:
        return value ** (-1.0 / exponent)
    if value <= reference_rate:
        raise ModelError(
            f"rate_hardening: {value:g} m/s, the rate that doubles the force, must be above the reference rate, "
            f"{reference_rate:g} m/s, at which it begins to grow"
        )
    return float(1.0 / np.log(value / reference_rate))


@dataclass(frozen=True)
class Hardening(StaticFactor):
    """A factor of a material's."""

    def is_doubt(self, magnitudes, addition, c, shapes, fitted):
        """The largest exponent: the force hardly hangs on the rate, as that of a spring of rings, whose friction asks
        only which way it moves. The smallest: it stands for what the spring itself lacks, as a softening one."""
        limits = self.shapes["exponent"]
        # 1.001, 0.999: a fit ends at a limit but for rounding
        return not 1.001 * limits.low < shapes.get("exponent", 1.0) < 0.999 * limits.high


EFFECT = Hardening(
    "rate_hardening",
    "m/s",
    {
        "exponent": Shape("", 0.7, 10.0, (1.0, 3.0)),
        "reference_rate": Shape("m/s", 1e-3, 10.0, (0.03, 1.0)),
        "rebound": Shape("", 0.2, 5.0, (1.0,)),
    },
    factor=factor,
    stated=stated,
    unstated=unstated,
    forms={
        "": ("exponent",),
        "logarithmic": ("reference_rate",),
        "uneven": ("exponent", "rebound"),
        "uneven_logarithmic": ("reference_rate", "rebound"),
    },
)
"""Limits of the rebound: a fifth is next to nothing beside the usual form, of loading only; five, as of a damper's. Not
varied: laws in |V|, which it is for, were found with 1.00."""
