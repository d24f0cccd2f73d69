"""The motion of a free body without a sensor, where momentum says it.

    m a = sum of applied forces - sum of forces measured on fixed bodies - sum of M_i a_i of the other bodies

over all that elements join to the body: each of the others has a channel of its motion, and each fixed body that an
element leads to has a measured force.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from crash_replay.recording import Recording

if TYPE_CHECKING:
    from .structure import Structure


def joined(structure: "Structure", name: str) -> set[str]:
    """The body and all that elements join to it; nothing passes through a fixed or driven body.

    An element of a carried body is one of its carrier, which feels what pushes it.
    """
    free = {body.name for body in structure.bodies if body.free}
    felt_by = {body.name: body.carried_by or body.name for body in structure.bodies}
    found: set[str] = set()
    reached = {name}
    while reached:
        found |= reached
        pairs = [{felt_by[end] for end in element.between} for element in structure.elements]
        reached = set().union(*(pair for pair in pairs if pair & reached & free)) - found
    return found


def lacking_for_momentum(structure: "Structure", name: str) -> str:
    """What has to be known yet of a body without a channel to tell how it moves; empty where nothing lacks."""
    return "; ".join(_lacks(structure, name))


def _lacks(structure: "Structure", name: str) -> Iterator[str]:
    group = joined(structure, name)
    if len(group) == 1:
        yield "no element leads to it"
    for k, body in enumerate(structure.bodies):
        if body.name not in group:
            continue
        for action in structure.actions:
            if action.at == k and action.kind in ("body", "inertia"):
                yield f"the force of {action.name} on {body.name} is not measured"
        if body.free and body.name != name and not body.is_measured:
            yield f"{body.name} has none either"
        if body.driven:
            yield f"the force on {body.name}, which is driven, is not measured"
        if body.fixed and not body.force:
            yield f"the force on {body.name} is not measured (`force: CHANNEL`)"
        if body.fixed and not all(set(e.between) <= group for e in structure.elements if body.name in e.between):
            yield f"the force on {body.name} is that of other bodies, too"


def acceleration_by_momentum(structure: "Structure", name: str, recording: Recording) -> np.ndarray:
    """(n,) m/s^2 of a body for whose momentum nothing lacks, NaN where a channel is; zeros taken before the impact.

    The others' acceleration channels are there: measured, or derived already.
    """
    group = joined(structure, name)
    force = np.zeros(len(recording.time_ns))
    for body in structure.bodies:
        if body.name not in group:
            continue
        if body.applied:
            force += _zeroed(recording, body.applied)
        if body.force:
            force -= _zeroed(recording, body.force)
        if body.free and body.name != name:
            force -= body.mass * np.mean([_zeroed(recording, channel) for channel in body.acceleration], axis=0)
    return force / structure.bodies[structure.body_index[name]].mass


def _zeroed(recording: Recording, name: str) -> np.ndarray:
    values = recording.column(name)
    before = values[(recording.time_ns < 0) & np.isfinite(values)]
    return values - before.mean() if len(before) else values
