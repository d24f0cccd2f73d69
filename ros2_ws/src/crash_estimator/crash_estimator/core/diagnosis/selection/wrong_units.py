"""A channel with the wrong sign or in another unit than stated: no effect of a structure.

Then the model leaves a large part of some channel, and next to nothing of that once the right values are taken.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from crash_replay.gravity import G
from crash_replay.recording import Recording, RecordingError

from ...derived_motion import with_accelerations
from ...effects.effect import Effect
from ...structure import Structure
from .fitted_model import Model
from .onset_search import model_as_stated
from .thresholds import THRESHOLDS

KILO = 1000.0
TAKEN_FOR = {"acceleration": (G, KILO), "force": (G, KILO), "displacement": (KILO,), "velocity": (KILO,)}
"""Quantity -> by what another unit is larger: g or mm/ms^2 than m/s^2, kgf or kN than N, m than mm."""

FASTER = 2.0
"""Times the largest speed in a test that a body may change its own by: thrown back as fast as it came."""


def refuse_wrong_units(
    structure: Structure, recordings: Sequence[Recording], given: Model, effects: Mapping[str, Effect]
) -> None:
    """Raises RecordingError with what may be wrong, where that explains nearly all that the model leaves.

    given: the model on all recordings; looked at is the one of which it leaves most.
    """
    left = _left(given)
    recording = recordings[int(np.argmax(left))]
    if max(left) < THRESHOLDS.some or given.untouched:  # it is as likely the structure that is the wrong way round
        return
    model = _model(structure, recording, effects)
    as_stated, hopeless = max(_left(model)), (1.0 - THRESHOLDS.nearly_all) * model.fit.cost
    others = _otherwise(structure, recording)
    left_by = {what: max(_left(_model(structure, other, effects, hopeless))) for what, other in others}
    enough = (1.0 - THRESHOLDS.nearly_all) * min(as_stated, 1.0)
    likely = sorted((what for what, left in left_by.items() if left < enough), key=left_by.__getitem__)
    if likely:
        raise RecordingError(
            f"test {recording.test.id}: {' or '.join(likely)}, it seems: of the worst channel's mean square the model "
            f"leaves {as_stated:.0%} as stated and {left_by[likely[0]]:.1%} so; mend the test's description and import "
            "it again, or the model's masses"
        )


def _otherwise(structure: Structure, recording: Recording) -> Iterator[tuple[str, Recording]]:
    """The recording with one thing mended."""
    for name, quantity in dict.fromkeys((name, quantity) for _, name, quantity in structure.channels()):
        yield f"channel {name} is reversed", _times(recording, name, -1.0)
        for factor in TAKEN_FOR[quantity]:
            yield f"channel {name} is {factor:.4g} times too small", _times(recording, name, factor)
            if quantity != "acceleration" or _is_too_fast(structure, recording, name):
                yield f"channel {name} is {factor:.4g} times too large", _times(recording, name, 1.0 / factor)


def _times(recording: Recording, name: str, factor: float) -> Recording:
    values = recording.values.copy()
    values[:, recording.test.index(name)] *= factor
    return replace(recording, values=values)


def _is_too_fast(structure: Structure, recording: Recording, name: str) -> bool:
    """Whether a channel changes its body's speed by more than the others and the stated ones let it. A motion that is
    made slower on less evidence may never come back: then any course of a force is a curve over its crush."""
    ours = [one for _, one, quantity in structure.channels() if quantity == "acceleration"]
    values = np.nan_to_num(recording.values[:, [recording.test.index(one) for one in ours]])
    change = np.abs(np.cumsum(values[1:] * np.diff(recording.time)[:, None], axis=0)).max(axis=0)
    speeds = [abs(velocity) for velocity in recording.test.initial_velocity.values()]
    speeds += [speed for one, speed in zip(ours, change, strict=True) if one != name]
    return change[ours.index(name)] > FASTER * max(speeds, default=np.inf)


def _model(
    structure: Structure, recording: Recording, effects: Mapping[str, Effect], hopeless: float = np.inf
) -> Model:
    structure, recordings = with_accelerations(structure, [recording])
    return model_as_stated(structure, recordings, effects, hopeless)


def _left(model: Model) -> list[float]:
    """Of each recording the largest share of any channel's mean square."""
    pairs = zip(model.records, model.residuals.residual, strict=True)
    return [
        float(np.max(np.nanmean(left**2, axis=0) / np.nanmean(record.measured**2, axis=0))) for record, left in pairs
    ]
