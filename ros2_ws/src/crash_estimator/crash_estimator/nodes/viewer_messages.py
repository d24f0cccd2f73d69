"""crash_msgs -> the viewer's blocks: the one file of the viewer that knows both worlds."""

import numpy as np
from crash_msgs.msg import Event, Forces, Parameters, Residuals, TestInfo

from ..viewer.blocks import EventBlock, ForceBlock, ParameterBlock, ResidualBlock, TestBlock


def test_block(message: TestInfo) -> TestBlock:
    return TestBlock(message.id, message.title, message.source, int(message.samples), float(message.sample_period))


def parameter_block(estimator: str, message: Parameters) -> ParameterBlock:
    names = tuple(message.name)
    return ParameterBlock(
        *_head(estimator, message),
        names,
        tuple(message.unit),
        **_tables(message, len(names), ("value", "std", "status")),
    )


def residual_block(estimator: str, message: Residuals) -> ResidualBlock:
    names = tuple(message.name)
    fields = ("measured", "predicted", "innovation", "innovation_std", "residual", "residual_std")
    return ResidualBlock(*_head(estimator, message), names, tuple(message.unit), **_tables(message, len(names), fields))


def force_block(estimator: str, message: Forces) -> ForceBlock:
    elements, bodies = tuple(message.element), tuple(message.body)
    return ForceBlock(
        *_head(estimator, message),
        elements,
        tuple(message.between),
        bodies,
        np.asarray(message.mass),
        **_tables(message, len(elements), ("crush", "force", "state")),
        **_tables(message, len(bodies), ("velocity", "acceleration")),
    )


def event_block(estimator: str, message: Event) -> EventBlock:
    return EventBlock(estimator, message.run, message.number, message.time, message.kind, message.target, message.text)


BLOCK_OF = {
    "parameters": (Parameters, parameter_block),
    "residuals": (Residuals, residual_block),
    "forces": (Forces, force_block),
    "events": (Event, event_block),
}
"""An estimator's topic -> its message type and what makes a block of it."""


def _head(estimator: str, message: Parameters | Residuals | Forces) -> tuple:
    time_ns = np.asarray(message.time_ns, dtype=np.int64)
    return estimator, message.run, message.number, time_ns, message.model, message.method


def _tables(message: Parameters | Residuals | Forces, width: int, fields: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Fields of n x width values, sent row by row. Raises ValueError where a length does not fit."""
    n = len(message.time_ns)
    return {name: np.asarray(getattr(message, name)).reshape(n, width) for name in fields}
