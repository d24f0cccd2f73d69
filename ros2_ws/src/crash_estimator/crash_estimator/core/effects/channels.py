"""Known errors of channels, taken out of the samples before an estimator sees them.

    recorded(t) = (1 + gain) true(t - delay) + offset(t),    the offset from time zero on

What a late channel says of an instant comes later than the others: all wait for the latest, so that the estimates
are of the instant `longest delay` before their sample.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from crash_replay.recording import Sample, Test

from ..structure import Structure
from . import EFFECTS
from .effect import Effect


class Offset(NamedTuple):
    """What is added to a channel."""

    channel: int
    effect: Effect
    form: str
    coefficient: float  # SI


class ChannelErrors(NamedTuple):
    """(channels,) each."""

    gain: np.ndarray
    delay: np.ndarray  # s
    offsets: tuple[Offset, ...] = ()

    def offset(self, seconds: float) -> np.ndarray:
        """SI, at an instant after the impact."""
        found = np.zeros(len(self.gain))
        for one in self.offsets:
            found[one.channel] += one.coefficient * float(one.effect.course(one.form, np.array(seconds)))
        return found


def known_errors(structure: Structure, test: Test, effects: Mapping[str, Effect] = EFFECTS) -> ChannelErrors | None:
    """Those that the model's effects give a coefficient for; None: there are none."""
    found, offsets, any_known = ChannelErrors(*np.zeros((2, len(test.channels)))), [], False
    for spec in structure.effects:
        effect = effects.get(spec.type)
        if effect is None or not effect.distorts or spec.coefficient is None:
            continue
        any_known = True
        for name in effect.channels(structure, spec.target):
            channel = test.index(name, f"effect {spec.type}")
            if effect.distorts == "offset":
                offsets.append(Offset(channel, effect, spec.variant, spec.coefficient))
            else:
                getattr(found, effect.distorts)[channel] += spec.coefficient
    return found._replace(offsets=tuple(offsets)) if any_known else None


class CorrectedState(NamedTuple):
    recent: tuple[tuple[int, np.ndarray], ...]  # (ns, values) of the samples that the longest delay reaches back to
    inner: Any


class Corrected:
    """Settings: the estimator, and the errors that its samples are freed of."""

    def __init__(self, estimator: Any, errors: ChannelErrors):
        self.estimator, self.errors = estimator, errors
        self.description = estimator.description
        self.longest = float(errors.delay.max())

    def init(self) -> CorrectedState:
        return CorrectedState((), self.estimator.init())

    def step(self, state: CorrectedState, sample: Sample):
        """Fold one sample in; `state` is left as it was."""
        offset = self.errors.offset(sample.time_ns * 1e-9) if sample.time_ns >= 0 else 0.0
        values = (sample.values - offset) / (1.0 + self.errors.gain)
        recent, instant = (*state.recent, (sample.time_ns, values)), sample.time_ns
        if self.longest > 0.0:
            instant = sample.time_ns - round(self.longest * 1e9)
            values = self._at(recent, instant)
            while len(recent) > 1 and recent[1][0] <= instant:
                recent = recent[1:]
        else:
            recent = ()
        inner, estimate = self.estimator.step(state.inner, Sample(sample.number, instant, values))
        return CorrectedState(recent, inner), estimate._replace(time_ns=sample.time_ns)

    def _at(self, recent: tuple[tuple[int, np.ndarray], ...], instant: int) -> np.ndarray:
        """(channels,) each as it was at the true instant; a recording's first values stand for what was before."""
        times, values = np.array([t for t, _ in recent]), np.array([v for _, v in recent])
        wanted = instant + np.rint(self.errors.delay * 1e9)
        return np.array([np.interp(w, times, column) for w, column in zip(wanted, values.T)])
