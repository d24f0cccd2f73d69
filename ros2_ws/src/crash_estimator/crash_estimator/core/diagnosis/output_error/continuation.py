"""Continuation: a fit goes through problems that become harder step by step, so that each begins close to its end.

At first an observer draws the simulation towards the measured motion, the noise is taken larger than it is, and contact
opens and closes over several steps of time; all of these fade out.
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


def _let_go(stages: int, last: float, less_believed: float) -> Schedule:
    """An observer that is let go in so many stages, to `last` 1/s, and with it the contacts' ramp; the noise is taken
    so many times as large as the observer counts.

    The first one holds a body within a quarter period of the fastest crash (5 ms). A force that jumps at separation is
    felt by the fit only while it jumps: ramped, it is drawn to the right instant.
    """
    rates, ramps = np.geomspace(200.0, last, stages), np.geomspace(16.0, 4.0, stages)
    return tuple(Stage(rate, less_believed * rate, ramp) for rate, ramp in zip(rates, ramps, strict=True))


FROM_MEASURED_MOTION: Schedule = (*_let_go(3, 20.0, 0.15), FROM_SIMULATION[-1])
"""Of a fit that starts from the measured motion."""

SMALL_STEPS: Schedule = (*_let_go(16, 3.0, 1.5), *FROM_SIMULATION)
"""Where that has led nowhere, as a light body between stiff elements may: less is believed at first, so that less is
fitted to a motion that is still wrong."""

LARGE_NOISE: Schedule = tuple(stage._replace(inflate=100.0 * stage.inflate) for stage in FROM_MEASURED_MOTION)
"""Where not even that leads anywhere, as with a measured motion that errs by far."""

SLOW_CONTACT: Schedule = tuple(Stage(0.0, 1.0, ramp) for ramp in np.repeat((8.0, 4.0, 2.0), 3))
"""Where a force that jumps at separation has stopped a fit short."""
