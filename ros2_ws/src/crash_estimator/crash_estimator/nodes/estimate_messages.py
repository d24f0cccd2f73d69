"""Estimates -> crash_msgs and back: the one file of the estimator that knows both worlds."""

from array import array
from collections.abc import Iterator, Sequence
from functools import lru_cache, partial, reduce
from typing import TypeVar

import numpy as np
from crash_msgs.msg import Event, Forces, ParametersBlock, ResidualsBlock

from crash_replay.cdr import Serialized
from crash_replay.ros_messages import stamp

from ..core.estimate import ROW, Description, Estimate, ParameterStatus, as_sent, nothing_said, sent
from ..following.columns import Columns

Message = TypeVar("Message", ParametersBlock, ResidualsBlock, Forces)
SIZES = 8
"""Lengths of blocks whose messages are kept to be filled again: a replay sends one, and what is left at the end."""


class EstimateMessages:
    """Makes the messages of a block of estimates, serialised: what they hold besides numbers is made once."""

    def __init__(self, description: Description, revision: int = 0):
        d = description
        ends = ["-".join(pair) for pair in d.between]
        empty = (
            ParametersBlock(name=[*d.parameters, *d.extra], unit=[*d.parameter_units, *d.extra_units]),
            ResidualsBlock(name=list(d.equations), unit=list(d.equation_units)),
            Forces(element=list(d.elements), between=ends, body=list(d.bodies), mass=array("d", d.masses)),
        )
        for message in empty:
            message.header.frame_id = message.model = d.model
            message.method, message.revision = d.method, revision
        self.description = description
        self._parameters, self._residuals, self._forces = (
            lru_cache(SIZES)(partial(Tables, message)) for message in empty
        )

    def parameters(self, stamp_ns: int, run: int, columns: Columns) -> bytes:
        """stamp_ns: of the first sample."""
        return self._parameters(len(columns)).filled(stamp_ns, run, columns)

    def residuals(self, stamp_ns: int, run: int, columns: Columns) -> bytes:
        return self._residuals(len(columns)).filled(stamp_ns, run, columns)

    def forces(self, stamp_ns: int, run: int, columns: Columns) -> bytes:
        return self._forces(len(columns)).filled(stamp_ns, run, columns)

    def events(self, stamp_ns: int, run: int, columns: Columns) -> list[Event]:
        messages = []
        for row, event in columns.events:
            time_ns = int(columns.time_ns[row])
            message = Event(run=run, number=columns.number + row, time=time_ns * 1e-9, **event._asdict())
            message.header.stamp = stamp(stamp_ns + time_ns - int(columns.time_ns[0]))
            message.header.frame_id = self.description.model
            messages.append(message)
        return messages


class Tables:
    """A serialised message on so many samples, filled again."""

    def __init__(self, empty: Message, samples: int):
        empty.time_ns = array("q", bytes(8 * samples))
        for field, name in FIELDS[type(empty)].items():
            count = samples * len(getattr(empty, NAMES[ROW[name].of]))
            setattr(empty, field, array("B", bytes(count)) if ROW[name].code else array("d", bytes(8 * count)))
        self.message = Serialized(empty)
        numbers = self.message.numbers
        self.run, self.number, self.time_ns = numbers["run"], numbers["number"], numbers["time_ns"]
        self.tables = [(field, numbers[field].reshape(samples, -1)) for field in FIELDS[type(empty)]]

    def filled(self, stamp_ns: int, run: int, columns: Columns) -> bytes:
        self.message.set_stamp(stamp_ns)
        self.run[0], self.number[0] = run, columns.number
        self.time_ns[:] = columns.time_ns
        for field, table in self.tables:
            table[:] = columns.of[field]
        return bytes(self.message)


def description_from(parameters: ParametersBlock, residuals: ResidualsBlock, forces: Forces) -> Description:
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
    parameters: Sequence[ParametersBlock], residuals: Sequence[ResidualsBlock], forces: Sequence[Forces]
) -> list[Estimate]:
    """The samples that all three kinds of message tell of, in order, without events.

    Of the covariances only the diagonals travel: all else in them is NaN.
    """
    by_kind = [
        {number: row for m in messages for number, row in samples_of(m)} for messages in (parameters, residuals, forces)
    ]
    numbers = sorted(set.intersection(*(set(rows) for rows in by_kind)))
    if not numbers:
        return []
    nothing = nothing_said(description_from(parameters[0], residuals[0], forces[0]))
    said = ((number, reduce(dict.__or__, (rows[number] for rows in by_kind))) for number in numbers)
    return [as_sent(nothing, number, fields["time_ns"], fields, np.nan) for number, fields in said]


FIELDS = {
    ParametersBlock: sent("parameters"),
    ResidualsBlock: sent("equations"),
    Forces: sent("elements", "bodies"),
}
"""Those with one row a sample, and what they are in an Estimate."""
NAMES = {"parameters": "name", "equations": "name", "elements": "element", "bodies": "body"}
"""Where a block has the names of what a row has values of."""


def samples_of(message: ParametersBlock | ResidualsBlock | Forces) -> Iterator[tuple[int, dict]]:
    """(number, fields) of each sample of a block."""
    n = len(message.time_ns)
    tables = {field: np.asarray(getattr(message, field)).reshape(n, -1) for field in FIELDS[type(message)]}
    for k in range(n):
        yield message.number + k, {"time_ns": message.time_ns[k]} | {field: rows[k] for field, rows in tables.items()}


def _parameters(status: Sequence[int], width: int) -> int:
    """How many of a sample's values are parameters of the model; the rest is of the method."""
    return width - int(np.count_nonzero(np.asarray(status[:width]) == ParameterStatus.METHOD))


def _ends(between: str, bodies: tuple[str, ...]) -> tuple[str, str]:
    """The two bodies of "body_a-body_b", where a name may have a hyphen itself."""
    pairs = ((a, b) for a in bodies for b in bodies if f"{a}-{b}" == between)
    return next(pairs, (between, ""))
