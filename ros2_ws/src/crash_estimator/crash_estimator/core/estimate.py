"""What every estimation method says about one sample, in one form, so that no consumer asks which method it was."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from enum import IntEnum
from typing import Any, NamedTuple

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


class Quantity(NamedTuple):
    """A number that an estimate says for each of the things that it is `of`."""

    of: str  # the field of Description that names them: parameters, equations, elements or bodies
    sent_as: str = ""  # its field in the messages, where that has another name
    code: bool = False  # a whole number: ParameterStatus, ElementState


ROW = {
    "parameters": Quantity("parameters", sent_as="value"),
    "std": Quantity("parameters"),
    "status": Quantity("parameters", code=True),
    "measured": Quantity("equations"),
    "predicted": Quantity("equations"),
    "innovation": Quantity("equations"),
    "innovation_std": Quantity("equations"),
    "residual": Quantity("equations"),
    "residual_std": Quantity("equations"),
    "crush": Quantity("elements"),
    "rate": Quantity("elements"),
    "force": Quantity("elements"),
    "force_std": Quantity("elements"),
    "state": Quantity("elements", code=True),
    "displacement": Quantity("bodies"),
    "velocity": Quantity("bodies"),
    "acceleration": Quantity("bodies"),
}
"""The one description of what travels of an estimate, in the order of the messages' fields.

The compiled recursion's rows, columns, messages, those by name and what reads them are derived from it. A further
number is a line here and a field of Estimate, what computes it (`estimator.py`, `compiled/follow.py`), and its line in
the `.msg`."""


DIAGONALS = {"std": "covariance", "innovation_std": "innovation_covariance"}
"""Roots of the diagonal of a matrix, of which no more travels."""


def sent(*of: str) -> dict[str, str]:
    """Field of the messages -> name, of what is said of parameters, equations, elements or bodies."""
    return {quantity.sent_as or name: name for name, quantity in ROW.items() if quantity.of in of}


@dataclass(frozen=True, eq=False)
class Estimate:
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

    def _replace(self, **changes: Any) -> "Estimate":
        """The same with other values of these fields."""
        return Estimate(**({one.name: getattr(self, one.name) for one in fields(Estimate)} | changes))

    @property
    def std(self) -> np.ndarray:
        """(p,) standard deviation of each parameter."""
        return standard_deviations(self.covariance)

    @property
    def innovation_std(self) -> np.ndarray:
        """(q,) standard deviation of each equation's innovation."""
        return np.sqrt(np.diagonal(self.innovation_covariance))


def nothing_said(description: Description, number: int = 0, time_ns: int = 0) -> Estimate:
    """An estimate of NaN, and of zeros where it is codes, for who knows only some of it to replace."""
    sizes = {of: len(getattr(description, of)) for of in ("parameters", "equations", "elements", "bodies")}
    said: dict[str, Any] = {
        name: np.zeros(sizes[of], dtype=np.uint8) if code else np.full(sizes[of], np.nan)
        for name, (of, _, code) in ROW.items()
        if name not in DIAGONALS
    }
    said |= {matrix: np.full((sizes[ROW[name].of],) * 2, np.nan) for name, matrix in DIAGONALS.items()}
    return Estimate(number=number, time_ns=time_ns, events=(), **said)


def as_sent(
    nothing: Estimate, number: int, time_ns: int, fields_sent: Mapping[str, np.ndarray], elsewhere: float
) -> Estimate:
    """What the messages' fields tell of a sample, without events; nothing: of its estimator, as to the rest.

    Of the covariances only the diagonals travel: all else in them is `elsewhere`.
    """
    own, said = len(nothing.parameters), {}
    for field, name in sent("parameters", "equations", "elements", "bodies").items():
        if field in fields_sent:
            values = fields_sent[field]
            said[name] = values[:own] if ROW[name].of == "parameters" else values
    for name, matrix in DIAGONALS.items():
        said[matrix] = np.full((len(said[name]),) * 2, elsewhere)
        np.fill_diagonal(said[matrix], said.pop(name) ** 2)
    extra, extra_std = (tuple(fields_sent[field][own:].tolist()) for field in ("value", "std"))
    return nothing._replace(number=number, time_ns=time_ns, **said, extra=extra, extra_std=extra_std)


def standard_deviations(covariance: np.ndarray) -> np.ndarray:
    """(p,) of a covariance (p, p); NaN where rounding has left none, as the thesis's recursions let it happen."""
    variance = np.diagonal(covariance)
    return np.sqrt(np.where(variance >= 0.0, variance, np.nan))
