"""Estimates -> crash_msgs and back: the one file of the estimator that knows both worlds."""

from array import array
from collections.abc import Iterator, Sequence
from typing import TypeVar

import numpy as np
from builtin_interfaces.msg import Time
from crash_msgs.msg import Event, Forces, Parameters, Residuals

from crash_replay.ros_messages import add_ns

from ..core.estimate import Description, Estimate, ParameterStatus
from ..following.columns import Columns

Message = TypeVar("Message", Parameters, Residuals, Forces)


class EstimateMessages:
    """Makes the messages of a block of estimates: one of each kind, filled again, so that it holds until the next call.

    Names and units are set once, for to make a message anew costs as much as to estimate.
    """

    def __init__(self, description: Description, revision: int = 0):
        d = description
        ends = ["-".join(pair) for pair in d.between]
        self._parameters = Parameters(name=[*d.parameters, *d.extra], unit=[*d.parameter_units, *d.extra_units])
        self._residuals = Residuals(name=list(d.equations), unit=list(d.equation_units))
        self._forces = Forces(element=list(d.elements), between=ends, body=list(d.bodies), mass=array("d", d.masses))
        self.description = description
        for message in (self._parameters, self._residuals, self._forces):
            message.model, message.method, message.revision = d.model, d.method, revision

    def parameters(self, stamp: Time, run: int, columns: Columns) -> Parameters:
        return _filled(self._parameters, stamp, run, columns)

    def residuals(self, stamp: Time, run: int, columns: Columns) -> Residuals:
        return _filled(self._residuals, stamp, run, columns)

    def forces(self, stamp: Time, run: int, columns: Columns) -> Forces:
        return _filled(self._forces, stamp, run, columns)

    def events(self, stamp: Time, run: int, columns: Columns) -> list[Event]:
        """stamp: of the first sample."""
        messages = []
        for row, event in columns.events:
            time_ns = int(columns.time_ns[row])
            message = Event(run=run, number=columns.number + row, time=time_ns * 1e-9, **event._asdict())
            message.header.stamp = add_ns(stamp, time_ns - int(columns.time_ns[0]))
            messages.append(message)
        return messages


def _filled(message: Message, stamp: Time, run: int, columns: Columns) -> Message:
    message.header.stamp = stamp
    message.run = run
    message.number = columns.number
    message.time_ns = array("q", columns.time_ns.tobytes())
    for field in FIELDS[type(message)]:
        table = columns.of[field]
        setattr(message, field, array("B" if table.dtype == np.uint8 else "d", table.tobytes()))
    return message


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
