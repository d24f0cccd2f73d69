"""`car_ax`, `engine_ax`, ... : the motion of a body, from all of its accelerometers along x that can be believed.

Which sensors contradict the others is found by `sensor_agreement`, and such a sensor is left out: of the mean, and of
the recording too unless it is asked for, so that nothing later takes it for a body of its own.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..recording import Channel
from ..sensor_agreement import Agreement, agreement, balance, impulse, velocity_change

ONE_RIGID_PART = "car"
"""The body that is rigid enough to compare its sensors: an engine turns, a dummy's head has one place only."""


class Sensor(NamedTuple):
    """An accelerometer along x that lasts for the whole record."""

    channel: Channel
    values: np.ndarray  # (n,) m/s^2
    near: bool = True  # False: on a part that deforms; it bears witness, but is no part of the mean


class BodyMotion(NamedTuple):
    columns: dict[Channel, np.ndarray]  # the means, a channel each
    outliers: tuple[str, ...]  # names of the channels that contradict the others
    notes: tuple[str, ...]


def body_motion(
    time: np.ndarray,
    sensors: Sequence[Sensor],
    masses: Mapping[str, float] = {},
    barrier: np.ndarray | None = None,
    source_of: Callable[[Sensor], str] = lambda sensor: sensor.channel.name,
) -> BodyMotion:
    """Means of the bodies' sensors at time (n,) in s.

    masses: kg by body; barrier: (n,) N, the force that stops a body which runs into it alone; source_of: what a mean's
    source calls a sensor.
    """
    bodies: dict[str, list[Sensor]] = {}
    for sensor in sensors:
        bodies.setdefault(sensor.channel.body, []).append(sensor)
    pushed = impulse(time, barrier) if barrier is not None and len(masses) == 1 else None
    compared = {body: _compared(time, members) for body, members in bodies.items() if _rigid(body)}
    compared |= _by_momentum(time, bodies, compared, masses, pushed)
    dropped = {bodies[body][k].channel.name for body, found in compared.items() for k in found.outliers}
    taken = {sensor.channel.name for sensor in sensors} - dropped
    columns, outliers, notes = {}, [], []
    for body, members in bodies.items():
        found = compared.get(body)
        if found:
            outliers += [members[k].channel.name for k in found.outliers]
            notes += _said(members, found)
        sound = [m for k, m in enumerate(members) if not (found and k in found.outliers)]
        chosen = [member for member in sound if member.near] or sound
        name = f"{body}_ax"
        if name in taken or not chosen:
            continue
        source = ("mean of " if len(chosen) > 1 else "") + ", ".join(map(source_of, chosen))
        columns[Channel(name, "acceleration", body, "x", source)] = np.mean([m.values for m in chosen], axis=0)
        of = ", ".join(member.channel.name for member in chosen)
        notes.append(f"{name}: mean of {of}" if len(chosen) > 1 else f"{name}: is {of}")
    motions = columns | {s.channel: s.values for s in sensors if s.channel.name == f"{s.channel.body}_ax"}
    changes = {c.body: velocity_change(time, values) for c, values in motions.items() if _rigid(c.body)}
    notes += filter(None, [balance(changes, masses, pushed)])
    return BodyMotion(columns, tuple(outliers), tuple(notes))


def _rigid(body: str) -> bool:
    return body.endswith(ONE_RIGID_PART)


def _compared(time: np.ndarray, members: Sequence[Sensor], momentum: float | None = None) -> Agreement:
    return agreement(time, [member.values for member in members], momentum)


def _by_momentum(
    time: np.ndarray,
    bodies: Mapping[str, Sequence[Sensor]],
    compared: Mapping[str, Agreement],
    masses: Mapping[str, float],
    pushed: float | None,
) -> dict[str, Agreement]:
    """Again, of bodies whose sensors contradict each other, with the momentum of what they ran into."""
    again = {}
    for body, found in compared.items():
        others = [other for other in compared if other != body and not compared[other].undecided]
        if not found.undecided or not masses.get(body):
            continue
        theirs = pushed
        if theirs is None and len(others) == 1 and masses.get(others[0]):
            theirs = masses[others[0]] * float(np.median(compared[others[0]].change))
        if theirs:
            again[body] = _compared(time, bodies[body], abs(theirs) / masses[body])
    return again


def _said(members: Sequence[Sensor], found: Agreement) -> list[str]:
    """A line for each sensor that contradicts the others, or one for all where nobody knows which are right."""
    change = [f"{member.channel.name} {3.6 * dv:.1f} km/h" for member, dv in zip(members, found.change)]
    sound = [3.6 * dv for k, dv in enumerate(found.change) if k not in found.outliers]
    if found.undecided:
        count, which = ("two", "which is") if len(members) == 2 else (f"most of its {len(members)}", "which are")
        return [f"{members[0].channel.body}: {count} sensors contradict each other, {which} right is not known: change "
                f"of velocity {', '.join(change)}; leave out what is wrong with --names or --channels"]  # fmt: skip
    return [
        f"outlier {members[k].channel.name}: its velocity is up to {found.deviation[k]:.0%} off the other sensors of "
        f"{members[k].channel.body} (change {3.6 * found.change[k]:.1f} km/h, theirs {min(sound):.1f} to "
        f"{max(sound):.1f}): left out (--all-sensors keeps its channel)"
        for k in found.outliers
    ]
