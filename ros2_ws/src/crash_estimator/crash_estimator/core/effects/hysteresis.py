"""Rate-independent hysteresis (Bouc 1967, Wen 1976): F = c z, which yields, and springs back when the motion turns.

    dz/dX = (1 - |z|^n (1 + sgn(z dX)) / 2) / X_y,      z from -1 to 1, 0 at first contact

X is the crush in m, compression positive; c in N, never negative: the force at which it yields. The crush X_y over
which it would come there, and how sharply (n = 1 gradual, 10 as a spring behind a dry slider), are found. Joints, foams
and slipping contacts do so; `coulomb_friction` is its limit for a small X_y, but turns with the rate at any speed.

Form `dahl` (Dahl 1968), of dry friction before it slips: dz/dX = (1 - |z|^n sgn(z dX)) / X_y, twice as stiff where the
motion turns.
"""

import numpy as np

from .effect import Shape
from .kinds import RememberingForce


def memory(time: np.ndarray, crush: np.ndarray, start: float, yield_crush: float, exponent: float, form: str = ""):
    """z (g,) from `start` at the first of the crushes (g,) m, and how it follows: see `RememberingForce`."""
    back = 1.0 if form == "dahl" else 0.0
    from .bouc_wen import trace  # the compiler takes long to import: only who needs it waits for it

    crush = np.ascontiguousarray(crush, dtype=float)
    z, kept, by_crush = trace(crush, float(start), float(yield_crush), float(exponent), back)
    return z, kept, by_crush, by_crush


EFFECT = RememberingForce(
    "hysteresis",
    "N",
    {
        "yield_crush": Shape("m", 0.001, 0.6, (0.05, 0.2), of_crush=True, both_ways=True),
        "exponent": Shape("", 1.0, 10.0, (2.0,)),
    },
    memory=memory,
    ways=("dahl",),
)
"""Limits of `yield_crush`, in shares of the largest crush: below a thousandth it is dry friction. With 0.01 four
looked-at dry joints, which give by 0.2 to 0.4 mm, were told as two frictions each, of half the force."""
