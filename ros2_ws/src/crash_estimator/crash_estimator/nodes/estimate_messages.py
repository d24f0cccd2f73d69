"""Estimates -> crash_msgs and back: the one file of the estimator that knows both worlds."""

from array import array
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from builtin_interfaces.msg import Time
from crash_msgs.msg import Event, Forces, Parameters, Residuals

from ..core.estimate import Description, Estimate, ParameterStatus


class EstimateMessages:
    """Makes the four messages of a block of estimates; names and units are set once."""

    def __init__(self, description: Description):
        self.description = description

    def parameters(self, stamp: Time, run: int, estimates: Sequence[Estimate]) -> Parameters:
        d = self.description
        message = Parameters(name=[*d.parameters, *d.extra], unit=[*d.parameter_units, *d.extra_units])
        self._head(message, stamp, run, estimates)
        if d.extra:
            estimates = [_with_extra(estimate) for estimate in estimates]
        message.value = _rows(estimates, "value" if d.extra else "parameters")
        message.std = _rows(estimates, "std")
        message.status = _bytes(estimates, "status")
        return message

    def residuals(self, stamp: Time, run: int, estimates: Sequence[Estimate]) -> Residuals:
        d = self.description
        message = Residuals(name=list(d.equations), unit=list(d.equation_units))
        self._head(message, stamp, run, estimates)
        for field in ("measured", "predicted", "innovation", "residual", "residual_std"):
            setattr(message, field, _rows(estimates, field))
        variances = np.array([np.diagonal(estimate.innovation_covariance) for estimate in estimates])
        message.innovation_std = array("d", np.sqrt(variances).tobytes())
        return message

    def forces(self, stamp: Time, run: int, estimates: Sequence[Estimate]) -> Forces:
        d = self.description
        message = Forces(element=list(d.elements), between=["-".join(ends) for ends in d.between], body=list(d.bodies))
        self._head(message, stamp, run, estimates)
        message.mass = array("d", d.masses)
        for field in ("crush", "rate", "force", "force_std", "displacement", "velocity", "acceleration"):
            setattr(message, field, _rows(estimates, field))
        message.state = _bytes(estimates, "state")
        return message

    def events(self, stamp: Time, run: int, estimate: Estimate) -> list[Event]:
        messages = []
        for event in estimate.events:
            message = Event(run=run, number=estimate.number, time=estimate.time_ns * 1e-9, **event._asdict())
            message.header.stamp = stamp
            messages.append(message)
        return messages

    def _head(self, message, stamp: Time, run: int, estimates: Sequence[Estimate]) -> None:
        message.header.stamp = stamp
        message.run = run
        message.number = estimates[0].number
        message.time_ns = array("q", [estimate.time_ns for estimate in estimates])
        message.model = self.description.model
        message.method = self.description.method


def description_from(parameters: Parameters, residuals: Residuals, forces: Forces) -> Description:
    """Names and units from one message of each kind."""
    bodies, count = tuple(forces.body), _parameters(parameters.status, len(parameters.name))
    return Description(
        model=parameters.model,
        method=parameters.method,
        parameters=tuple(parameters.name[:count]),
        parameter_units=tuple(parameters.unit[:count]),
        equations=tuple(residuals.name),
        equation_units=tuple(residuals.unit),
        elements=tuple(forces.element),
        between=tuple(_ends(between, bodies) for between in forces.between),
        bodies=bodies,
        masses=tuple(forces.mass),
        extra=tuple(parameters.name[count:]),
        extra_units=tuple(parameters.unit[count:]),
    )


def estimates_from(
    parameters: Sequence[Parameters], residuals: Sequence[Residuals], forces: Sequence[Forces]
) -> list[Estimate]:
    """The samples that all three kinds of message tell of, in order, without events.

    Of the covariances only the diagonals travel: all else in them is NaN.
    """
    by_kind = [
        {number: row for m in messages for number, row in _samples(m)} for messages in (parameters, residuals, forces)
    ]
    estimates = []
    for number in sorted(set.intersection(*(set(rows) for rows in by_kind))):
        p, r, f = (rows[number] for rows in by_kind)
        count = _parameters(p["status"], len(p["status"]))
        estimates.append(
            Estimate(
                number=number,
                time_ns=p["time_ns"],
                parameters=p["value"][:count],
                covariance=_diagonal(p["std"][:count]),
                status=p["status"][:count],
                extra=tuple(p["value"][count:].tolist()),
                extra_std=tuple(p["std"][count:].tolist()),
                innovation_covariance=_diagonal(r["innovation_std"]),
                **{field: r[field] for field in ("measured", "predicted", "innovation", "residual", "residual_std")},
                **{field: f[field] for field in ("crush", "rate", "force", "force_std", "state")},
                **{field: f[field] for field in ("displacement", "velocity", "acceleration")},
                events=(),
            )
        )
    return estimates


FIELDS = {
    Parameters: ("value", "std", "status"),
    Residuals: ("measured", "predicted", "innovation", "innovation_std", "residual", "residual_std"),
    Forces: ("crush", "rate", "force", "force_std", "state", "displacement", "velocity", "acceleration"),
}
"""Those with one row a sample."""


def _samples(message: Parameters | Residuals | Forces) -> Iterator[tuple[int, dict]]:
    """(number, fields) of each sample of a block."""
    n = len(message.time_ns)
    tables = {field: np.asarray(getattr(message, field)).reshape(n, -1) for field in FIELDS[type(message)]}
    for k in range(n):
        yield message.number + k, {"time_ns": message.time_ns[k]} | {field: rows[k] for field, rows in tables.items()}


class _Row(NamedTuple):
    """Parameters and what the method knows besides, as they travel."""

    value: np.ndarray
    std: np.ndarray
    status: np.ndarray


def _with_extra(estimate: Estimate) -> _Row:
    besides = np.full(len(estimate.extra), ParameterStatus.METHOD, dtype=np.uint8)
    return _Row(
        np.concatenate([estimate.parameters, estimate.extra]),
        np.concatenate([estimate.std, estimate.extra_std]),
        np.concatenate([estimate.status, besides]),
    )


def _parameters(status: Sequence[int], width: int) -> int:
    """How many of a sample's values are parameters of the model; the rest is of the method."""
    return width - int(np.count_nonzero(np.asarray(status[:width]) == ParameterStatus.METHOD))


def _diagonal(std: np.ndarray) -> np.ndarray:
    matrix = np.full((len(std), len(std)), np.nan)
    np.fill_diagonal(matrix, std**2)
    return matrix


def _ends(between: str, bodies: tuple[str, ...]) -> tuple[str, str]:
    """The two bodies of "body_a-body_b", where a name may have a hyphen itself."""
    pairs = ((a, b) for a in bodies for b in bodies if f"{a}-{b}" == between)
    return next(pairs, (between, ""))


def _rows(estimates: Sequence[Estimate], field: str) -> array:
    """A (p,) field of n estimates as one row-major array of n * p doubles."""
    return array("d", b"".join(getattr(estimate, field).tobytes() for estimate in estimates))


def _bytes(estimates: Sequence[Estimate], field: str) -> array:
    return array("B", b"".join(getattr(estimate, field).tobytes() for estimate in estimates))
