"""What every estimation method says about one sample, in one form, so that no consumer asks which method it was."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np


class ParameterStatus(IntEnum):
    """Where a parameter's value comes from at this sample (as in crash_msgs/Parameters)."""

    ESTIMATED = 0
    KNOWN = 1  # given in the model
    UNLOADING = 2  # held while its element unloads along its known slope
    APART = 3  # its element carries nothing
    CLAMPED = 4  # held at its bound for this step
    METHOD = 5  # no parameter of the model: what the method knows besides, such as a noise model or a weight


class ElementState(IntEnum):
    """What an element does at this sample (as in crash_msgs/Forces)."""

    LOADING = 0
    UNLOADING = 1
    APART = 2


class Event(NamedTuple):
    """Something happened at a sample."""

    # loading | unloading | apart | clamped | rewound | jump | orders | released | masses | lost | dropout | effect
    kind: str
    target: str  # element, parameter, equation or channel
    value: float  # crush in m, index steps, probability: as the text says
    text: str  # one readable line


class Description(NamedTuple):
    """Names and units of an estimator's outputs; they do not change from sample to sample."""

    model: str
    method: str
    parameters: tuple[str, ...]  # "door_rib.stiffness", ...
    parameter_units: tuple[str, ...]  # "N/m", "N*s/m", ...
    equations: tuple[str, ...]  # the body whose balance (or measured force) it is
    equation_units: tuple[str, ...]  # "m/s^2" for a free body, "N" for a measured force
    elements: tuple[str, ...]
    between: tuple[tuple[str, str], ...]  # the two bodies of each element
    bodies: tuple[str, ...]
    masses: tuple[float, ...]  # kg, NaN where the model gives none (driven, fixed)
    extra: tuple[str, ...] = ()  # what the method knows besides the parameters: "car.ar1", "model0.weight", ...
    extra_units: tuple[str, ...] = ()


class Estimate(NamedTuple):
    """The state of knowledge after one sample: p parameters, q equations, e elements, b bodies."""

    number: int  # of the sample
    time_ns: int  # ns since the impact
    parameters: np.ndarray  # (p,) in parameter_units
    covariance: np.ndarray  # (p, p); zero rows for known parameters
    status: np.ndarray  # (p,) ParameterStatus, uint8
    measured: np.ndarray  # (q,) in equation_units; NaN where there is no valid measurement
    predicted: np.ndarray  # (q,) with the updated parameters
    innovation: np.ndarray  # (q,) measured minus predicted before the update
    innovation_covariance: np.ndarray  # (q, q)
    residual: np.ndarray  # (q,) measured minus predicted after the update
    residual_std: np.ndarray  # (q,) innovation's where nothing was updated; NaN where no noise is known
    crush: np.ndarray  # (e,) m
    rate: np.ndarray  # (e,) m/s
    force: np.ndarray  # (e,) N, compression positive
    force_std: np.ndarray  # (e,) N
    state: np.ndarray  # (e,) ElementState, uint8
    displacement: np.ndarray  # (b,) m
    velocity: np.ndarray  # (b,) m/s
    acceleration: np.ndarray  # (b,) m/s^2, measured, zero offset removed; NaN where not measured
    events: tuple[Event, ...]
    extra: tuple[float, ...] = ()  # the values of Description.extra, NaN until there are any
    extra_std: tuple[float, ...] = ()  # of each, NaN where none is known

    @property
    def std(self) -> np.ndarray:
        """(p,) standard deviation of each parameter."""
        return standard_deviations(self.covariance)


def standard_deviations(covariance: np.ndarray) -> np.ndarray:
    """(p,) of a covariance (p, p); NaN where rounding has left none, as the thesis's recursions let it happen."""
    variance = np.diagonal(covariance)
    return np.sqrt(np.where(variance >= 0.0, variance, np.nan))
