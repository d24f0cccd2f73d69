"""A cushion of gas with a hole (airbag, bladder, tyre): F = c y, with y the overpressure over that of the air outside.

    y = (m / (1 - X / L))^n - 1 >= 0,      dm/dt = - w sqrt(y),      m = 1 at first contact

X is the crush in m, compression positive; c in N, never negative, is the pressure outside times the cushion's area; its
length L in m, which no crush reaches, and w in 1/s, at which its gas would leave at twice the pressure outside, are
found. m is the share of the gas that is left; as the cushion opens, what is missing flows in freely. The gas keeps its
heat (n = 1.4, of air) or, in the form `isothermal`, gives it to the walls (n = 1); it leaves as water would (Bernoulli,
which holds below a third of the speed of sound). It is a nonlinear spring where w is small, a damper of the square of
the rate where it is large.
"""

import numpy as np

from .effect import Shape
from .kinds import RememberingForce

EXPONENTS = {"": 1.4, "isothermal": 1.0}
"""Form -> polytropic exponent n: the ratio of the specific heats of air, and where the gas stays as warm as it is."""


def memory(time: np.ndarray, crush: np.ndarray, start: float, length: float, leak: float, form: str = ""):
    """y (g,) from `start` at the first of the crushes (g,) m, and how it follows: see `RememberingForce`."""
    from .vented_gas import trace  # the compiler takes long to import: only who needs it waits for it

    step, crush = np.diff(time, prepend=time[0]), np.ascontiguousarray(crush, dtype=float)
    return trace(step, crush, float(start), float(length), float(leak), EXPONENTS[form])


EFFECT = RememberingForce(
    "gas_cushion",
    "N",
    {
        "length": Shape("m", 1.05, 5.0, (1.3, 2.5), of_crush=True),
        "leak": Shape("1/s", 1.0, 300.0, (10.0, 50.0)),
    },
    memory=memory,
    ways=("isothermal",),
    bounded=False,
    rare=True,
)
"""Limits of the leak: what takes 0.5 s to lose half of its gas at twice the pressure outside is tight to a crash;
what has lost it within 3 ms is hardly felt. With 5 1/s as the lower limit two of three looked-at cushions of 3 to 4 1/s
were told of a gas that gives its heat away, with a coefficient 6 and 10 standard deviations off; with 1 none."""
