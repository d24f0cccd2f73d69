"""Continuation: a fit goes through problems that become harder step by step, so that each begins close to its end.

At first an observer draws the simulation towards the measured motion, the noise is taken larger than it is, and contact
opens and closes over several steps of time; all of these fade out.

Of each schedule the observers, the factors on the noise and the ramps were halved and doubled: none of 34 looked-at
cases was told otherwise. They took 1.00 to 1.15 times the iterations with another `FROM_MEASURED_MOTION`, 1.00 to 1.13
with another `FROM_SIMULATION`, 1.00 with other `SMALL_STEPS` and 0.98 to 1.00 with another `SLOW_CONTACT`.
"""

from typing import NamedTuple

import numpy as np


class Stage(NamedTuple):
    """One iteration's problem."""

    observer: float  # 1/s
    inflate: float  # factor on the noise
    contact_ramp: float  # steps of time in which contact opens and closes


Schedule = tuple[Stage, ...]

FREE_RUN = Stage(0.0, 1.0, 1.0)
"""The problem itself."""

FROM_SIMULATION: Schedule = (Stage(0.0, 2.0, 6.0), Stage(0.0, 1.0, 2.0))
"""Of a fit that starts from a simulation of another model."""


FROM_MEASURED_MOTION: Schedule = (
    Stage(200.0, 30.0, 16.0), Stage(80.0, 10.0, 8.0), Stage(30.0, 3.0, 4.0), FROM_SIMULATION[-1],
)  # fmt: skip
"""Of a fit that starts from the measured motion. The first observer holds a body within a quarter period of the fastest
crash (5 ms). A force that jumps at separation is felt by the fit only while it jumps: ramped, it is drawn to the right
instant. With 63 and 20 in place of 80 and 30 the engine of NHTSA 10146, which rings, is named too, filtered or not."""

SMALL_STEPS: Schedule = (
    *(
        Stage(observer, 1.5 * observer, ramp)
        for observer, ramp in zip(np.geomspace(200.0, 3.0, 16), np.geomspace(16.0, 2.0, 16), strict=True)
    ),
    *FROM_SIMULATION,
)
"""Where that has led nowhere, as a light body between stiff elements may: the observer is let go in small steps, and
less is believed at first, so that less is fitted to a motion that is still wrong."""

SLOW_CONTACT: Schedule = tuple(Stage(0.0, 1.0, ramp) for ramp in np.repeat((8.0, 4.0, 2.0), 3))
"""Where a force that jumps at separation has stopped a fit short."""
