"""A case: a structure drawn at random, with effects hidden in it, to be recorded at any speed, noise and rate."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...recording import Recording, RecordingError
from ..scenario import Truth, record
from ..truth_file import truth_text, yaml_text
from .observable import ON_ELEMENTS, SHOWS, distance, targets
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
    peaks = peaks_of(specimen)
    return [effect for effect in EFFECTS if effect in ON_ELEMENTS or targets(specimen, peaks, effect)]


def draw_case(
    structure: str, effects: Sequence[str] = (), seed: int = 1, size: float = 1.0, at: Mapping[str, str] | None = None
) -> HiddenCase:
    """A structure with `effects` hidden in it, `size` times as large as nominal; no effects: none is hidden.

    at: effect -> target, where it is not to be drawn. Raises RecordingError where the effects cannot be hidden, or
    would not show (see `observable`).
    """
    if structure not in STRUCTURES:
        raise RecordingError(f"there is no structure {structure!r}: give one of {', '.join(STRUCTURES)}")
    for effect in effects:
        if effect not in EFFECTS:
            raise RecordingError(f"there is no effect {effect!r} to hide: give one of {', '.join(EFFECTS)}")
    known: set[str] = set()
    for draw in range(DRAWS):
        rng = np.random.default_rng([seed, draw])
        specimen = STRUCTURES[structure](rng)
        if not effects:
            return HiddenCase(seed, specimen, ())
        peaks = peaks_of(specimen)
        hidden = _hide(specimen, peaks, effects, size, at or {}, rng)
        if hidden:
            return HiddenCase(seed, *hidden)
        known |= {t for effect in effects for t in targets(specimen, peaks, effect)}
    wanted = ", ".join(f"{e} on {at[e]}" if at and e in at else e for e in effects)
    raise RecordingError(
        f"{wanted} cannot be told in structure {structure}: "
        + (f"it can be on {', '.join(sorted(known))}" if known else "it has no target there")
    )


def _hide(
    specimen: Specimen, peaks: Peaks, effects: Sequence[str], size: float, at: Mapping[str, str], rng: np.random.Generator
) -> tuple[Specimen, tuple[Hidden, ...]] | None:
    """None where an effect has no target in this specimen, or none where it shows."""
    bare, done = specimen, []
    for effect in effects:
        free = [t for t in targets(bare, peaks, effect) if t not in [h.target for h in done]]
        free = [t for t in free if t == at.get(effect, t)]
        if not free:
            return None
        target, share, stream = str(rng.choice(free)), rng.uniform(*NOMINAL), int(rng.integers(2**32))
        nominal, _ = EFFECTS[effect](bare, peaks, target, share, np.random.default_rng(stream))
        if distance(bare, nominal) < SHOWS:
            return None
        specimen, hidden = EFFECTS[effect](specimen, peaks, target, size * share, np.random.default_rng(stream))
        done.append(hidden)
    return specimen, tuple(done)
