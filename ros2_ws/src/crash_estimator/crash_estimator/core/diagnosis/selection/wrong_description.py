"""A sign, a unit or a speed that is not as the test's description says: no effect of a structure.

Then the model leaves a large part of some channel, and next to nothing of that once the right values are taken; or,
where an effect is missing as well, at least half of it goes.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

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

FASTER = 2.0
"""Times the largest speed in a test that a body may change its own by, and times the momentum at that speed that forces
may take: thrown back as fast as they came."""


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

    path: what was found on all recordings; looked at is the one of which the model as given leaves most.

    Raises RecordingError where something explains nearly all, and nothing that was found does.
    """
    given = path.steps[0].before
    left = _left(given)
    recording = recordings[int(np.argmax(left))]
    if path.noise and not path.added:
        return ""
    if max(left) < THRESHOLDS.some and not _go_on(structure, recording):
        return ""
    others = list(_other_speeds(structure, recording))
    if not given.untouched:  # else it is as likely the structure that is the wrong way round
        others += _other_channels(structure, recording)
    if not others:
        return ""
    model = _model(structure, recording, effects)
    hopeless = THRESHOLDS.near_floor * cost_of_noise(model.records) if path.noise else THRESHOLDS.half * model.fit.cost
    mended = []
    for what, other in others:
        otherwise = _model(structure, other, effects, hopeless)
        mended.append(_Mended(what, otherwise, 1.0 - otherwise.fit.cost / model.fit.cost))
    likely = [one for one in mended if (one.model.white if path.noise else one.explained > THRESHOLDS.half)]
    if not likely:
        return ""
    likely.sort(key=lambda one: -one.explained)
    what = " or ".join(one.what for one in likely[: THRESHOLDS.few])
    as_stated, least = max(_left(model)), min(max(_left(one.model)) for one in likely)
    if not path.noise and least < (1.0 - THRESHOLDS.nearly_all) * min(as_stated, 1.0):
        raise RecordingError(
            f"test {recording.test.id}: {what}, it seems: of the worst channel's mean square the model leaves "
            f"{as_stated:.0%} as stated and {least:.1%} so; mend the test's description and import it again, or the "
            "model's masses"
        )
    then = "only noise would be left" if path.noise else f"{likely[0].explained:.0%} of the misfit would go"
    return f"perhaps, in test {recording.test.id}, {what}: mended, {then}"


def _other_channels(structure: Structure, recording: Recording) -> Iterator[tuple[str, Recording]]:
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
            yield f"{which} reversed", _times(recording, names, -1.0)
        bounded = quantity == "acceleration" or (fastest and on_fixed.issuperset(names))  # by the stated speeds
        for factor in TAKEN_FOR[quantity]:
            larger, smaller = (_times(recording, names, by) for by in (factor, 1.0 / factor))
            if not bounded or not _is_too_much(structure, larger, names, quantity):
                yield f"{which} {factor:.4g} times too small", larger
            if not bounded or _is_too_much(structure, recording, names, quantity):
                yield f"{which} {factor:.4g} times too large", smaller
    if go_on and len(quantities) > 1:
        yield "all channels are reversed", _times(recording, list(quantities), -1.0)


def _other_speeds(structure: Structure, recording: Recording) -> Iterator[tuple[str, Recording]]:
    """The recording with bodies that come as fast as they lose speed, where they cannot have come as stated: unless a
    driven body may have struck them."""
    if any(body.driven for body in structure.bodies):
        return
    changes = _changes_of_speed(structure, recording).values()
    if changes and min(map(abs, changes)) > FASTER * _fastest(recording):
        lost = -max(changes, key=abs)
        there = {body.name: lost for body in structure.bodies if body.free}
        if not VELOCITY.wrong(lost):
            mended = replace(recording, test=replace(recording.test, initial_velocity=there))
            yield f"initial_velocity is rather {lost / FASTER:.2g} to {lost:.2g} m/s", mended


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
