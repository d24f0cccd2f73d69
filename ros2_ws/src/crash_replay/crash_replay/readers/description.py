"""The YAML beside a recording: what its test and channels are. Keys are checked; a typo is named with its line."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from ..limits import DISPLACEMENT, VELOCITY
from ..recording import Channel, Recording, RecordingError, Test
from ..shortened import shortened
from ..yaml_schema import Text, load_yaml, number, suggestion
from .dates import checked_stamp

Axis = Literal["x", "y", "z", ""]
Velocity, Displacement = number(VELOCITY), number(DISPLACEMENT)
Velocities = dict[Text, Velocity]
"""Body -> m/s."""
Displacements = dict[Text, Displacement]
"""Body -> m."""


class Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class TestPart(Part):
    id: str | None = Field(default=None, coerce_numbers_to_str=True)
    title: str = ""
    source: str = ""
    date: Annotated[str, BeforeValidator(str)] = ""  # and time, UTC; YAML reads most dates as what they are

    __test__ = False  # not a pytest class


class ChannelNames(Part):
    """What is given replaces what the format says of a channel."""

    name: Text | None = None
    body: Text | None = None
    axis: Axis | None = None


class RecordedChannel(ChannelNames):
    """`sign: -1`: the sensor was mounted the other way round; its values are turned, nothing else is."""

    sign: Literal[1, -1] = 1


class Names(Part):
    """`import.yaml` in an NHTSA or ISO-MME folder, or the file given with `--names`.

    channels and turned go by the names and bodies that the import gives; both take patterns such as `vehicle2_*`.
    turned: bodies that face the other way, as the second of two cars that meet: x and y of their channels, and their
    initial velocity, change sign. What is given for initial_velocity and initial_displacement is taken as it stands.
    """

    test: TestPart = TestPart()
    channels: dict[str, RecordedChannel] = {}
    turned: list[Text] = []
    initial_velocity: Velocities = {}
    initial_displacement: Displacements = {}


def apply_names(recording: Recording, path: Path) -> Recording:
    """The recording with the names, bodies, signs and initial motion that a `Names` file gives.

    A channel that moves to another body takes its initial velocity along. Raises RecordingError where
    the file names a channel or body that the recording has not got.
    """
    names = load_yaml(path, Names)
    test = recording.test
    given = _given(test.channels, names, path)
    turned = _turned_bodies(test, names, path)
    signs = np.array([_sign(channel, given[channel], turned) for channel in test.channels])
    channels = tuple(_renamed(channel, given[channel], sign) for channel, sign in zip(test.channels, signs))
    stated = {body: -v if body in turned and v else v for body, v in test.initial_velocity.items()}
    inherited = {new.body: stated[old.body] for old, new in zip(test.channels, channels) if old.body in stated}
    changed: dict[str, Any] = dict(
        id=names.test.id or test.id,
        title=names.test.title or test.title,
        source=names.test.source or test.source,
        impact_ns=checked_stamp(names.test.date, f"{path}: test.date") or test.impact_ns,
        channels=channels,
        initial_velocity=inherited | names.initial_velocity,
        initial_displacement=dict(test.initial_displacement) | names.initial_displacement,
        notes=(
            *test.notes,
            f"names taken from {path.name}",
            *([f"turned round, x, y and initial velocity: {shortened(sorted(turned))}"] if turned else []),
            *unknown_bodies(channels, names.initial_velocity),
        ),
    )
    try:
        return Recording(replace(test, **changed), recording.time_ns, recording.values * signs)
    except RecordingError as error:  # two channels of one name, for instance
        raise RecordingError(f"{path}: {error}") from None


def _given(channels: Sequence[Channel], names: Names, path: Path) -> dict[Channel, RecordedChannel]:
    """What the file says of each channel: under its name, else under the first pattern that matches."""
    known = [channel.name for channel in channels]
    for pattern, said in names.channels.items():
        matching = [name for name in known if fnmatchcase(name, pattern)]
        if not matching:
            raise RecordingError(
                f"{path}: channels.{pattern}: the recording has no such channel; {suggestion(pattern, known)}"
            )
        if len(matching) > 1 and said.name:
            raise RecordingError(
                f"{path}: channels.{pattern}: a pattern of {len(matching)} channels cannot give them one name: leave "
                "out `name`, or give each channel its own entry"
            )
    return {
        channel: names.channels.get(channel.name)
        or next((said for pattern, said in names.channels.items() if fnmatchcase(channel.name, pattern)), None)
        or RecordedChannel()
        for channel in channels
    }


def _turned_bodies(test: Test, names: Names, path: Path) -> set[str]:
    bodies = sorted({c.body for c in test.channels if c.body} | set(test.initial_velocity))
    turned: set[str] = set()
    for pattern in names.turned:
        matching = {body for body in bodies if fnmatchcase(body, pattern)}
        if not matching:
            raise RecordingError(f"{path}: turned: no channel is on a body {pattern!r}; {suggestion(pattern, bodies)}")
        turned |= matching
    return turned


def _sign(channel: Channel, names: RecordedChannel, turned: Collection[str]) -> float:
    return names.sign * (-1.0 if channel.body in turned and channel.axis in ("x", "y") else 1.0)


def _renamed(channel: Channel, names: RecordedChannel, sign: float) -> Channel:
    return Channel(
        names.name or channel.name,
        channel.quantity,
        channel.body if names.body is None else names.body,
        channel.axis if names.axis is None else names.axis,
        channel.source + ("; sign turned" if sign < 0 else ""),
    )


def unknown_bodies(channels: Iterable[Channel], named: Iterable[str]) -> list[str]:
    """A note for each body that has an initial velocity but no channel: perhaps a typo."""
    bodies = sorted({channel.body for channel in channels if channel.body})
    return [
        f"initial velocity of {b!r}: no channel is on this body; {suggestion(b, bodies)}"
        for b in named
        if b not in bodies
    ]
