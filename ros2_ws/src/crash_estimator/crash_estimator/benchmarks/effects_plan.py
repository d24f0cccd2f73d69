"""Which hidden-effect cases are judged: every structure and effect, then where it gets hard.

A case is all that decides it, so its name alone makes it again, bit for bit.
"""

from collections.abc import Iterator
from functools import cache
from itertools import product
from typing import NamedTuple

import numpy as np

from crash_replay.recording import RecordingError
from crash_replay.synthetic.hidden.cases import hideable
from crash_replay.synthetic.hidden.outside import OUTSIDE
from crash_replay.synthetic.hidden.structures import STRUCTURES

TWO, ONE = (0.75, 1.1), (1.1,)
"""Speeds of the recordings, of the nominal one."""

NOISES = (0.5, 1.0, 2.0)
SIZES = (0.5, 0.25, 0.125)
HARD_NOISES = (5.0, 10.0)

SEEDS = 35_000_000
"""The first of the judging seeds: nothing was built on them, nor may it be. Once something has been, or they were
looked at, as those from 1 to 34 million on, the next ones judge."""

FULL, SLOW = 10_000.0, 1_000.0
"""Hz."""


class Case(NamedTuple):
    structure: str
    effects: tuple[str, ...]  # empty: nothing hidden
    size: float  # times the nominal one
    noise: float  # g
    rate: float  # Hz
    speeds: tuple[float, ...]  # one for each recording
    seed: int

    @property
    def name(self) -> str:
        hidden, speeds = "+".join(self.effects) or "none", ",".join(f"{v:g}" for v in self.speeds)
        return f"{self.structure}/{hidden}/{self.size:g}/{self.noise:g}g/{self.rate:g}Hz/{speeds}/{self.seed}"


def case_of(name: str) -> Case:
    """The case that a name means; raises RecordingError where it is not one."""
    try:
        structure, hidden, size, noise, rate, speeds, seed = name.split("/")
        effects = () if hidden == "none" else tuple(hidden.split("+"))
        return Case(
            structure, effects, float(size), float(noise.removesuffix("g")), float(rate.removesuffix("Hz")),
            tuple(map(float, speeds.split(","))), int(seed),
        )  # fmt: skip
    except ValueError:
        example = Case("dummy", ("coulomb_friction",), 1.0, 1.0, FULL, TWO, 1).name
        raise RecordingError(f"a case's name is written like {example}, got {name!r}") from None


@cache
def plan(first_seed: int = SEEDS) -> tuple[Case, ...]:
    """All cases in a mixed order, so that any beginning of it is a sample of the whole; each has a seed of its own."""
    drawn = [*_vocabulary(), *_nothing(), *_outside(), *_pairs(), *_hard()]
    order = np.random.default_rng(0).permutation(len(drawn)).tolist()
    return tuple(Case._make((*drawn[k], first_seed + n)) for n, k in enumerate(order))


@cache
def _single_effects() -> tuple[tuple[str, str], ...]:
    return tuple((s, e) for s in STRUCTURES for e in hideable(s) if e not in OUTSIDE)


def _vocabulary() -> Iterator[tuple]:
    for (structure, effect), noise in product(_single_effects(), NOISES):
        for _ in range(3 if noise == 1.0 else 2):
            yield structure, (effect,), 1.0, noise, FULL, TWO
        yield structure, (effect,), 1.0, noise, FULL, ONE


def _nothing() -> Iterator[tuple]:
    for structure, noise in product(STRUCTURES, NOISES):
        yield from [(structure, (), 1.0, noise, FULL, TWO)] * 10
        yield from [(structure, (), 1.0, noise, FULL, ONE)] * 3
    for structure in STRUCTURES:
        yield from [(structure, (), 1.0, 1.0, SLOW, TWO)] * 2
        for noise in HARD_NOISES:
            yield from [(structure, (), 1.0, noise, FULL, TWO)] * 2


def _outside() -> Iterator[tuple]:
    for structure, effect, noise in product(STRUCTURES, OUTSIDE, NOISES):
        yield from [(structure, (effect,), 1.0, noise, FULL, TWO)] * 3


def _pairs() -> Iterator[tuple]:
    """Two different effects at once, drawn evenly."""
    rng = np.random.default_rng(1)
    for structure in STRUCTURES:
        effects = [e for s, e in _single_effects() if s == structure]
        for _ in range(16):
            yield structure, tuple(map(str, rng.choice(effects, 2, replace=False))), 1.0, 1.0, FULL, TWO


def _hard() -> Iterator[tuple]:
    for structure, effect in _single_effects():
        for size in SIZES:
            yield structure, (effect,), size, 1.0, FULL, TWO
        for noise in HARD_NOISES:
            yield structure, (effect,), 1.0, noise, FULL, TWO
        yield structure, (effect,), 1.0, 1.0, SLOW, TWO
