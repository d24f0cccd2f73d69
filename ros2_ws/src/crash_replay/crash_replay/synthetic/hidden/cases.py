"""A case: a structure drawn at random, with effects hidden in it, to be recorded at any speed, noise and rate."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...recording import Recording, RecordingError
from ..scenario import Truth, record
from ..truth_file import truth_text, yaml_text
from .observable import nameable, shows, targets
from .outside import OUTSIDE
from .specimen import Peaks, Specimen, peaks_of
from .structures import STRUCTURES
from .vocabulary import VOCABULARY, Hidden, Hide

EFFECTS: Mapping[str, Hide] = {**VOCABULARY, **OUTSIDE}

NOMINAL = (0.12, 0.35)
"""Share of the target's peak force that an effect of size 1 makes."""

DRAWS = 40
"""Structures drawn until one has a target where the effect shows."""


@dataclass(frozen=True)
class HiddenCase:
    """The same seed is the same structure with the same effect, at whatever speed, noise and rate it is recorded."""

    seed: int
    specimen: Specimen  # with the effects
    hidden: tuple[Hidden, ...]

    @property
    def model_text(self) -> str:
        """The model file, which does not tell of the effects."""
        return yaml_text(self.specimen.model)

    def truth_text(self, truth: Truth) -> str:
        """The truth file of one of its recordings."""
        return truth_text(truth, {"hidden": [hidden.described() for hidden in self.hidden]})

    def record(self, speed: float = 1.0, noise: float = 1.0, rate: float = 10_000.0) -> tuple[Recording, Truth]:
        """At a multiple of the nominal speed, with accelerometer noise in g (standard deviation), at a rate in Hz."""
        drawn = self.specimen.scenario
        scenario = replace(
            drawn, name=f"{drawn.name}_{self.seed}_{speed:g}", rate=rate,
            title=f"{drawn.title}; drawn with seed {self.seed}, at {speed:g} of its nominal speed",
        )  # fmt: skip
        return record(scenario.at_speed(speed).with_noise(noise), self.seed * 100_000 + round(1000 * speed))


def hideable(structure: str) -> list[str]:
    """The effects that can be hidden in a structure; one that acts on an element, in some draws of it."""
    specimen = STRUCTURES[structure](np.random.default_rng(0))
    return [effect for effect in EFFECTS if nameable(specimen, effect)]


def draw_case(
    structure: str, effects: Sequence[str] = (), seed: int = 1, size: float = 1.0, at: Mapping[str, str] | None = None
) -> HiddenCase:
    """A structure with `effects` hidden in it, `size` times as large as nominal; no effects: none is hidden.

    at: effect -> target, where it is not to be drawn. Raises RecordingError where the effects cannot be hidden, or
    would not show (see `observable`).
    """
    at = at or {}
    _check(structure, effects, at)
    for draw in range(DRAWS):
        rng = np.random.default_rng([seed, draw])
        specimen = STRUCTURES[structure](rng)
        if not effects:
            return HiddenCase(seed, specimen, ())
        hidden = _hide(specimen, peaks_of(specimen), effects, size, at, rng)
        if hidden:
            return HiddenCase(seed, *hidden)
    wanted = ", ".join(f"{e} on {at[e]}" if e in at else e for e in effects)
    raise RecordingError(
        f"{wanted} shows in none of {DRAWS} draws of structure {structure} with seed {seed}: try another"
    )


def _check(structure: str, effects: Sequence[str], at: Mapping[str, str]) -> None:
    if structure not in STRUCTURES:
        raise RecordingError(f"there is no structure {structure!r}: give one of {', '.join(STRUCTURES)}")
    specimen = STRUCTURES[structure](np.random.default_rng(0))
    for effect in effects:
        if effect not in EFFECTS:
            raise RecordingError(f"there is no effect {effect!r} to hide: give one of {', '.join(EFFECTS)}")
        could = nameable(specimen, effect)
        if at.get(effect, could[0] if could else None) not in could:
            wanted = f"{effect} on {at[effect]}" if effect in at else effect
            reason = f"it can be on {', '.join(could)}" if could else "it has no target there"
            raise RecordingError(f"{wanted} cannot be told in structure {structure}: {reason}")


class _Drawn(NamedTuple):
    effect: str
    target: str
    share: float
    stream: int  # seed of what else the effect draws


def _hide(
    bare: Specimen, peaks: Peaks, effects: Sequence[str], size: float, at: Mapping[str, str], rng: np.random.Generator
) -> tuple[Specimen, tuple[Hidden, ...]] | None:
    """None where an effect has no target in this specimen, or does not show beside the others."""
    drawn: list[_Drawn] = []
    for effect in effects:
        free = [t for t in targets(bare, peaks, effect) if t not in [d.target for d in drawn]]
        free = [t for t in free if t == at.get(effect, t)]
        if not free:
            return None
        drawn.append(_Drawn(effect, str(rng.choice(free)), rng.uniform(*NOMINAL), int(rng.integers(2**32))))
    nominal, _ = _with(bare, peaks, drawn, 1.0)
    for one in drawn:
        others, _ = _with(bare, peaks, [d for d in drawn if d is not one], 1.0)
        if not shows(others, one.effect, one.target, nominal):
            return None
    return _with(bare, peaks, drawn, size)


def _with(
    specimen: Specimen, peaks: Peaks, drawn: Sequence[_Drawn], size: float
) -> tuple[Specimen, tuple[Hidden, ...]]:
    done = []
    for effect, target, share, stream in drawn:
        specimen, hidden = EFFECTS[effect](specimen, peaks, target, size * share, np.random.default_rng(stream))
        done.append(hidden)
    return specimen, tuple(done)
