"""What the viewer is given: blocks of an estimator's output as arrays. Neither ROS nor Rerun here.

A block holds n consecutive samples; its `estimator` says who speaks, which is each revision of a model for itself; its
`time_ns` and what is `said_of` each sample have n rows. SI units, as in crash_msgs.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ..core.estimate import sent


@dataclass(frozen=True)
class TestBlock:
    """What the test is."""

    id: str
    title: str
    source: str
    samples: int
    sample_period: float  # s

    __test__: ClassVar[bool] = False  # not a pytest class


REVISION = " revision "
"""Between an estimator's name, which has no spaces, and the number of its model's revision."""


def speaker(estimator: str, revision: int) -> str:
    """Who says it: "kalman" with the model as it was given, "kalman revision 1" with the first change."""
    return f"{estimator}{REVISION}{revision}" if revision else estimator


def estimator_of(who: str) -> str:
    return who.partition(REVISION)[0]


def revision_of(who: str) -> int:
    return int(who.partition(REVISION)[2] or 0)


UNKNOWN_TEST = TestBlock("test", "", "", 0, 0.0)


class ParameterBlock(NamedTuple):
    """n samples of p parameters."""

    estimator: str
    run: int
    number: int  # of the first sample
    time_ns: np.ndarray  # (n,) ns since the impact
    model: str
    method: str
    name: tuple[str, ...]
    unit: tuple[str, ...]
    value: np.ndarray  # (n, p)
    std: np.ndarray  # (n, p)
    status: np.ndarray  # (n, p) ParameterStatus


class ResidualBlock(NamedTuple):
    """n samples of q equations; NaN where there is no valid measurement."""

    estimator: str
    run: int
    number: int
    time_ns: np.ndarray
    model: str
    method: str
    name: tuple[str, ...]  # the body whose balance, or measured force, it is
    unit: tuple[str, ...]
    measured: np.ndarray  # (n, q)
    predicted: np.ndarray
    innovation: np.ndarray
    innovation_std: np.ndarray
    residual: np.ndarray
    residual_std: np.ndarray


class ForceBlock(NamedTuple):
    """n samples of e elements and b bodies."""

    estimator: str
    run: int
    number: int
    time_ns: np.ndarray
    model: str
    method: str
    element: tuple[str, ...]
    between: tuple[str, ...]  # "body_a-body_b"
    body: tuple[str, ...]
    mass: np.ndarray  # (b,) kg, NaN where the model gives none
    crush: np.ndarray  # (n, e) m
    force: np.ndarray  # (n, e) N, compression positive
    state: np.ndarray  # (n, e) ElementState
    velocity: np.ndarray  # (n, b) m/s
    acceleration: np.ndarray  # (n, b) m/s^2, measured; NaN where it is not
    rate: np.ndarray  # (n, e) m/s, of crush
    displacement: np.ndarray  # (n, b) m


class EventBlock(NamedTuple):
    """One event."""

    estimator: str
    run: int
    number: int
    time: float  # s since the impact
    kind: str
    target: str
    text: str


Block = ParameterBlock | ResidualBlock | ForceBlock
"""A stretch of samples from one estimator."""


def said_of(block: Block | type[Block], *of: str) -> list[str]:
    """Its fields with a row a sample, as they are called in the messages; of: only what is of parameters, ..."""
    fields = sent(*(of or ("parameters", "equations", "elements", "bodies")))
    return [field for field in block._fields if field in fields]


def join(blocks: Iterable[Block]) -> list[Block]:
    """The same samples in as few blocks as possible: one for each estimator, run and kind, in order of appearance.

    Rerun takes a thousand rows at once for little more than the price of one.
    """
    groups: dict[tuple, list[Block]] = {}
    for block in blocks:
        names = block.element if isinstance(block, ForceBlock) else block.name
        groups.setdefault((type(block), block.estimator, block.run, block.model, names), []).append(block)
    return [_joined(group) for group in groups.values()]


def _joined(group: list[Block]) -> Block:
    first = group[0]
    if len(group) == 1:
        return first
    over_time = ("time_ns", *said_of(first))
    joined: dict[str, Any] = {name: np.concatenate([getattr(b, name) for b in group]) for name in over_time}
    return first._replace(**joined)
