"""The YAML beside a recording: what its test and channels are. Keys are checked; a typo is named with its line."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from ..limits import DISPLACEMENT, VELOCITY
from ..recording import Channel, Recording, RecordingError
from ..yaml_schema import Text, load_yaml, number, suggestion
from .dates import checked_stamp

Axis = Literal["x", "y", "z", ""]
Velocities = dict[Text, number(VELOCITY)]
"""Body -> m/s."""
Displacements = dict[Text, number(DISPLACEMENT)]
"""Body -> m."""


class Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class TestPart(Part):
    id: str | None = Field(None, coerce_numbers_to_str=True)
    title: str = ""
    source: str = ""
    date: Annotated[str, BeforeValidator(str)] = ""  # and time, UTC; YAML reads most dates as what they are

    __test__ = False  # not a pytest class


class ChannelNames(Part):
    """What is given replaces what the format says of a channel."""

    name: Text | None = None
    body: Text | None = None
    axis: Axis | None = None


class Names(Part):
    """`import.yaml` in an NHTSA or ISO-MME folder, or the file given with `--names`."""

    test: TestPart = TestPart()
    channels: dict[str, ChannelNames] = {}
    initial_velocity: Velocities = {}
    initial_displacement: Displacements = {}


def apply_names(recording: Recording, path: Path) -> Recording:
    """The recording with the names, bodies and initial motion that a `Names` file gives.

    A channel that moves to another body takes its initial velocity along. Raises RecordingError where
    the file names a channel that the recording has not got.
    """
    names = load_yaml(path, Names)
    test = recording.test
    for name in names.channels:
        if name not in test.channel_names:
            hint = suggestion(name, list(test.channel_names))
            raise RecordingError(f"{path}: channels.{name}: the recording has no such channel; {hint}")
    channels = tuple(_renamed(channel, names.channels.get(channel.name, ChannelNames())) for channel in test.channels)
    stated = test.initial_velocity
    inherited = {new.body: stated[old.body] for old, new in zip(test.channels, channels) if old.body in stated}
    changed = dict(
        id=names.test.id or test.id,
        title=names.test.title or test.title,
        source=names.test.source or test.source,
        impact_ns=checked_stamp(names.test.date, f"{path}: test.date") or test.impact_ns,
        channels=channels,
        initial_velocity=inherited | names.initial_velocity,
        initial_displacement=dict(test.initial_displacement) | names.initial_displacement,
        notes=(*test.notes, f"names taken from {path.name}", *unknown_bodies(channels, names.initial_velocity)),
    )
    try:
        return Recording(replace(test, **changed), recording.time_ns, recording.values)
    except RecordingError as error:  # two channels of one name, for instance
        raise RecordingError(f"{path}: {error}") from None


def _renamed(channel: Channel, names: ChannelNames) -> Channel:
    return Channel(
        names.name or channel.name,
        channel.quantity,
        channel.body if names.body is None else names.body,
        channel.axis if names.axis is None else names.axis,
        channel.source,
    )


def unknown_bodies(channels: Iterable[Channel], named: Iterable[str]) -> list[str]:
    """A note for each body that has an initial velocity but no channel: perhaps a typo."""
    bodies = sorted({channel.body for channel in channels if channel.body})
    return [
        f"initial velocity of {b!r}: no channel is on this body; {suggestion(b, bodies)}"
        for b in named
        if b not in bodies
    ]
