"""The motion of a mass that hangs on a body by a spring and a damper, from the body's own acceleration a (compiled).

    u'' + 2 zeta w u' + w^2 u = - a,      a_hung = a + u'' = - w^2 u - 2 zeta w u',      w = 2 pi f

with u in m, how far it is from where it hangs at rest, f its natural frequency in Hz with the body held, and zeta the
damping ratio. Between two instants a is a straight line, for which each step is exact (Nigam and Jennings 1969).
"""

import cmath

import numpy as np
from numba import njit

from . import compile_cache as _compile_cache  # noqa: F401  before any compiled function is defined

SLOWLY = 1e-9
"""Of a frequency: damped so nearly critically the mass does not swing, and the sine over it is the time itself."""


@njit(cache=True)
def _step(h, w, zeta):
    """What a free swing leaves of u and u' after h s: u of u, u of u', u' of u, u' of u'."""
    fast = w * cmath.sqrt(complex(1.0 - zeta * zeta))
    decay = np.exp(-zeta * w * h)
    swing = cmath.cos(fast * h).real
    lag = (cmath.sin(fast * h) / fast).real if abs(fast) > SLOWLY * w else h
    return (
        decay * (swing + zeta * w * lag), decay * lag, -decay * w * w * lag, decay * (swing - zeta * w * lag)
    )  # fmt: skip


@njit(cache=True)
def hung(step, carrier, start, frequency, damping):
    """Acceleration (g,) m/s^2 of the mass, and (u, u') at the end; from `start` at the first instant on.

    step (g,) s from the instant before; carrier (g,) m/s^2 of the body that it hangs on; frequency in Hz.
    """
    w, zeta = 2.0 * np.pi * frequency, damping
    found = np.empty(len(carrier))
    u, v = start
    h, uu, uv, vu, vv = -1.0, 1.0, 0.0, 0.0, 1.0
    for t in range(len(carrier)):
        if t and step[t] > 0.0:
            if step[t] != h:
                h = step[t]
                uu, uv, vu, vv = _step(h, w, zeta)
            slope = (carrier[t] - carrier[t - 1]) / h
            still = 2.0 * zeta * slope / w**3  # a steady u for the straight line: still - a / w^2
            u, v = u - still + carrier[t - 1] / w**2, v + slope / w**2
            u, v = uu * u + uv * v + still - carrier[t] / w**2, vu * u + vv * v - slope / w**2
        found[t] = -w * w * u - 2.0 * zeta * w * v
    return found, (u, v)
