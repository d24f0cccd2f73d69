"""A sign, a unit or a speed that is not as the test's description says: no effect of a structure.

Then the model leaves a large part of some channel, and next to nothing of that once the right values are taken; or,
where an effect is missing as well, at least half of it goes.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.constants import kmh, mph

from crash_replay.gravity import G
from crash_replay.limits import VELOCITY
from crash_replay.recording import Recording, RecordingError

from ...derived_motion import with_accelerations
from ...effects.effect import Effect
from ...structure import Structure
from .acceptance import cost_of_noise
from .fitted_model import Model
from .onset_search import model_as_stated
from .selection_path import SelectionPath
from .thresholds import THRESHOLDS

KILO = 1000.0
TAKEN_FOR = {"acceleration": (G, KILO), "force": (G, KILO), "displacement": (KILO,), "velocity": (KILO,)}
"""Quantity -> by what another unit is larger: g or mm/ms^2 than m/s^2, kgf or kN than N, m than mm."""

FASTER = 2.2
"""Times the largest speed in a test that a body may change its own by, and times the momentum at that speed that forces
may take: 2 when thrown back as fast as they came, and a tenth for what noise and a sensor's gain add to that."""

SPEEDS = {"km/h": kmh, "mph": mph}
"""Unit that a speed may be stated in -> m/s."""


class _Doubt(NamedTuple):
    """Recordings of which something in the description may be wrong, and what."""

    model: Model  # as given, of these recordings
    others: Sequence[tuple[str, Sequence[Recording]]]  # what is wrong, and the recordings with that mended

    @property
    def tests(self) -> str:
        ids = [record.test.id for record in self.model.records]
        return f"test {ids[0]}" if len(ids) == 1 else f"tests {' and '.join(ids)}"


class _Mended(NamedTuple):
    """One thing of the description."""

    what: str  # is wrong
    model: Model  # as given, with that mended
    explained: float  # share of the misfit


def wrong_description(
    structure: Structure, recordings: Sequence[Recording], path: SelectionPath, effects: Mapping[str, Effect]
) -> str:
    """What may be wrong in the description of a test: where it explains at least half of what the model as given
    leaves, or leaves noise by itself as what was found does; empty where nothing does.

    path: what was found on all recordings. Looked at by itself is the one that the model as given, fitted to it alone,
    leaves most of; at all of them only for speeds in another unit, which each alone may do with.

    Raises RecordingError where something explains nearly all, and nothing that was found does.
    """
    given = path.steps[0].before
    if path.noise and not path.added:
        return ""
    doubts = [_between(structure, recordings, given)] if len(recordings) > 1 else []
    if max(_most_left(given)) >= THRESHOLDS.some or any(_go_on(structure, recording) for recording in recordings):
        doubts.insert(0, _in_the_worst(structure, recordings, given, effects))
    return next(filter(None, (_said_of(doubt, structure, path, effects) for doubt in doubts)), "")


def _in_the_worst(
    structure: Structure, recordings: Sequence[Recording], given: Model, effects: Mapping[str, Effect]
) -> _Doubt:
    alone = [_model(structure, [recording], effects) for recording in recordings]
    worst = int(np.argmax([max(_most_left(model)) for model in alone]))
    recording = recordings[worst]
    others = [*_other_speeds(structure, recording), *_slower(structure, [recording], [0])]
    if not given.untouched:  # else it is as likely the structure that is the wrong way round
        others += _other_channels(structure, recording)
    return _Doubt(alone[worst], others)


def _between(structure: Structure, recordings: Sequence[Recording], given: Model) -> _Doubt:
    """Of several recordings the speeds of one, or of all."""
    every = range(len(recordings))
    those = [*([k] for k in every), list(every)]
    return _Doubt(given, [each for these in those for each in _slower(structure, recordings, these)])


def _said_of(doubt: _Doubt, structure: Structure, path: SelectionPath, effects: Mapping[str, Effect]) -> str:
    cost, records = doubt.model.fit.cost, doubt.model.records
    hopeless = THRESHOLDS.near_floor * cost_of_noise(records) if path.noise else THRESHOLDS.half * cost
    mended = []
    for what, recordings in doubt.others:
        otherwise = _model(structure, recordings, effects, hopeless)
        mended.append(_Mended(what, otherwise, 1.0 - otherwise.fit.cost / cost))
    likely = [one for one in mended if (one.model.white if path.noise else one.explained > THRESHOLDS.half)]
    if not likely:
        return ""
    likely.sort(key=lambda one: -one.explained)
    what = " or ".join(one.what for one in likely[: THRESHOLDS.few])
    as_stated, least = max(_most_left(doubt.model)), min(max(_most_left(one.model)) for one in likely)
    if not path.noise and least < (1.0 - THRESHOLDS.nearly_all) * min(as_stated, 1.0):
        raise RecordingError(
            f"{doubt.tests}: {what}, it seems: of the worst channel's mean square the model leaves {as_stated:.0%} as "
            f"stated and {least:.1%} so; mend the test's description and import it again, or the model's masses"
        )
    then = "only noise would be left" if path.noise else f"{likely[0].explained:.0%} of the misfit would go"
    return f"perhaps, in {doubt.tests}, {what}: mended, {then}"


def _other_channels(structure: Structure, recording: Recording) -> Iterator[tuple[str, Sequence[Recording]]]:
    """The recording with the sign or unit of one channel mended, or of all of a quantity, or the sign of all, and what
    is wrong then."""
    quantities = {name: quantity for _, name, quantity in structure.channels()}
    alike = [[name for name in quantities if quantities[name] == quantity] for quantity in TAKEN_FOR]
    go_on, fastest = _go_on(structure, recording), _fastest(recording)
    on_fixed = {body.force for body in structure.bodies if body.fixed}
    for names in [*([name] for name in quantities), *(names for names in alike if len(names) > 1)]:
        quantity = quantities[names[0]]
        which = f"channel {names[0]} is" if len(names) == 1 else f"channels {' and '.join(names)} are"
        if quantity != "acceleration" or names not in alike or go_on:
            yield f"{which} reversed", [_times(recording, names, -1.0)]
        bounded = quantity == "acceleration" or (fastest and on_fixed.issuperset(names))  # by the stated speeds
        for factor in TAKEN_FOR[quantity]:
            larger, smaller = (_times(recording, names, by) for by in (factor, 1.0 / factor))
            if not bounded or not _is_too_much(structure, larger, names, quantity):
                yield f"{which} {factor:.4g} times too small", [larger]
            if not bounded or _is_too_much(structure, recording, names, quantity):
                yield f"{which} {factor:.4g} times too large", [smaller]
    if go_on and len(quantities) > 1:
        yield "all channels are reversed", [_times(recording, list(quantities), -1.0)]


def _other_speeds(structure: Structure, recording: Recording) -> Iterator[tuple[str, Sequence[Recording]]]:
    """The recording with bodies that come as fast as they lose speed, where they cannot have come as stated: unless a
    driven body may have struck them."""
    if any(body.driven for body in structure.bodies):
        return
    changes = _changes_of_speed(structure, recording).values()
    if changes and min(map(abs, changes)) > FASTER * _fastest(recording):
        lost = -max(changes, key=abs)
        there = {body.name: lost for body in structure.bodies if body.free}
        if not VELOCITY.wrong(lost):
            yield f"initial_velocity is rather {lost / 2.0:.2g} to {lost:.2g} m/s", [_coming_at(recording, there)]


def _slower(
    structure: Structure, recordings: Sequence[Recording], which: Sequence[int]
) -> Iterator[tuple[str, Sequence[Recording]]]:
    """The recordings with the speeds of some that were stated in another unit, where as stated no body of these loses
    all of its speed, and slower ones could lose what they do."""
    lost = [max(map(abs, _changes_of_speed(structure, recordings[k]).values()), default=np.inf) for k in which]
    stated = [_fastest(recordings[k]) for k in which]
    of = f" of {recordings[which[0]].test.id}" if len(which) < len(recordings) else ""
    for unit, one in SPEEDS.items():
        most = min(1.0, FASTER * one)
        if all(change < most * speed for change, speed in zip(lost, stated, strict=True)):
            mended = list(recordings)
            for k in which:
                speeds = recordings[k].test.initial_velocity
                mended[k] = _coming_at(recordings[k], {name: one * speed for name, speed in speeds.items()})
            yield f"initial_velocity{of} is stated in {unit} instead of m/s", mended


def _coming_at(recording: Recording, speeds: Mapping[str, float]) -> Recording:
    return replace(recording, test=replace(recording.test, initial_velocity=speeds))


def _times(recording: Recording, names: Sequence[str], factor: float) -> Recording:
    values = recording.values.copy()
    values[:, [recording.test.index(name) for name in names]] *= factor
    return replace(recording, values=values)


def _changes_of_speed(structure: Structure, recording: Recording) -> dict[str, float]:
    """m/s by acceleration channel, the farthest from where it begins."""
    ours = [name for _, name, quantity in structure.channels() if quantity == "acceleration"]
    values = np.nan_to_num(recording.values[:, [recording.test.index(name) for name in ours]])
    change = np.cumsum(values[1:] * np.diff(recording.time)[:, None], axis=0)
    return {name: float(max(each.min(), each.max(), key=abs)) for name, each in zip(ours, change.T, strict=True)}


def _is_too_much(structure: Structure, recording: Recording, names: Sequence[str], quantity: str) -> bool:
    """Whether accelerations all change their bodies' speed by more than the others and the stated ones let them, or
    forces on fixed bodies take more momentum than all bodies bring. A motion that is made slower on less evidence may
    never come back: then any course of a force is a curve over its crush."""
    if quantity == "force":
        return _takes_too_much(structure, recording, names)
    changes = {name: abs(change) for name, change in _changes_of_speed(structure, recording).items()}
    others = [change for name, change in changes.items() if name not in names]
    return min(changes[name] for name in names) > FASTER * (max([_fastest(recording), *others]) or np.inf)


def _takes_too_much(structure: Structure, recording: Recording, names: Sequence[str]) -> bool:
    force = np.nan_to_num(recording.values[:, [recording.test.index(name) for name in names]]).sum(axis=1)
    impulse = np.abs(np.cumsum(force[1:] * np.diff(recording.time))).max(initial=0.0)
    brought = sum(body.mass or 0.0 for body in structure.bodies if body.free) * _fastest(recording)
    return bool(impulse > FASTER * brought)


def _go_on(structure: Structure, recording: Recording) -> bool:
    """Whether bodies gain speed in the impact, as these came: all reversed, what brakes them never comes back."""
    changes, speeds = _changes_of_speed(structure, recording), recording.test.initial_velocity
    return sum(speeds.get(b.name, 0.0) * changes[name] for b in structure.bodies for name in b.acceleration) > 0.0


def _fastest(recording: Recording) -> float:
    """m/s, of the stated speeds."""
    return max(map(abs, recording.test.initial_velocity.values()), default=0.0)


def _model(
    structure: Structure, recordings: Sequence[Recording], effects: Mapping[str, Effect], hopeless: float = np.inf
) -> Model:
    structure, recordings = with_accelerations(structure, recordings)
    return model_as_stated(structure, recordings, effects, hopeless)


def _most_left(model: Model) -> list[float]:
    """Of each recording the largest share of any channel's mean square."""
    pairs = zip(model.records, model.residuals.residual, strict=True)
    return [
        float(np.max(np.nanmean(left**2, axis=0) / np.nanmean(record.measured**2, axis=0))) for record, left in pairs
    ]
