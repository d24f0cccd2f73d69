"""Recordings as rosbag2 bags (MCAP): `/test` says what the test is, `/channels/<name>` carry its channels.

Every topic but `/test` has a standard type, so a bag opens in Foxglove, PlotJuggler and Rerun without
our packages. A stamp is time_zero plus the time since the impact. The same recording and name give the
same bytes. What `record` makes of a replay has `/samples` instead, and is read as well.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from . import limits
from .bag_contents import Topic, bag_files, read_topics
from .bag_namespace import TEST_TOPIC, TEST_TYPE, is_read, own_topics, parted
from .bag_writer import LATCHED, STREAM, TopicToWrite, write_mcap, write_metadata
from .channel_messages import CARRIERS, SECOND, decode, encode
from .message_types import decode_test, encode_test
from .output import written
from .recording import Channel, Recording, RecordingError, Test
from .samples_in_bag import SAMPLES_TOPIC, read_samples

CHANNEL_TOPICS = "/channels/"
NAME = re.compile(r"[A-Za-z](_?[A-Za-z0-9])*_?")
"""What ROS takes as a part of a topic's name."""

SAME_CLOCK = 0.75
"""A channel with less than this share of the stamps has not lost messages but runs on another clock."""


def time_zero_ns(recording: Recording) -> int:
    """Stamp of the impact: its date; else whole seconds, so late that the first sample's stamp is 1 s or more."""
    if recording.test.impact_ns:
        return recording.test.impact_ns
    before = max(0, -int(recording.time_ns[0]))
    return SECOND * (1 + -(-before // SECOND))


def write_bag(recording: Recording, path: str | Path, overwrite: bool = False) -> Path:
    """Write a rosbag2 folder, or a single file where `path` ends in .mcap. Only a complete bag appears there.

    Raises OutputError where it cannot be written, RecordingError where the name is taken (with `overwrite`: by
    something that is not a bag), and where a channel's name or axis does not fit into a ROS topic.
    """
    path = Path(path)
    _check_channels(recording.test)
    _check_free(path, overwrite)
    with written(path) as bag:
        if path.suffix == ".mcap":
            write_mcap(bag, _topics(recording.test), _messages(recording))
        else:
            bag.mkdir()
            file = bag / f"{bag.name}.mcap"
            write_metadata(bag, write_mcap(file, _topics(recording.test), _messages(recording)))
    return path


def _topics(test: Test) -> list[TopicToWrite]:
    channels = [TopicToWrite(CHANNEL_TOPICS + c.name, CARRIERS[c.quantity].type, STREAM) for c in test.channels]
    return [TopicToWrite(TEST_TOPIC, TEST_TYPE, LATCHED), *channels]


def _messages(recording: Recording) -> Iterator[tuple[int, int, bytes]]:
    """(index in `_topics`, stamp, message): the test, then the channels' values sample by sample."""
    zero = time_zero_ns(recording)
    stamps = recording.time_ns + zero
    columns = [encode(channel, stamps, recording.values[:, k]) for k, channel in enumerate(recording.test.channels)]
    yield 0, int(stamps[0]), bytes(encode_test(recording, zero))
    for stamp, *row in zip(stamps.tolist(), *columns):
        for topic, message in enumerate(row, start=1):
            yield topic, stamp, message


def _check_channels(test: Test) -> None:
    if not test.channels:
        raise RecordingError(f"test {test.id} has no channels: nothing to write")
    for channel in test.channels:
        if not NAME.fullmatch(channel.name):
            raise RecordingError(
                f"channel {channel.name!r} cannot be a ROS topic: a name starts with a letter and has letters, digits "
                "and single underscores; give it another one in the YAML beside the data (name: ...)"
            )


def _check_free(path: Path, overwrite: bool) -> None:
    if not path.exists():
        return
    if not overwrite:
        raise RecordingError(f"{path} exists already: give another name, or replace it with --force")
    if path.suffix == ".mcap":
        replaceable = path.is_file()
    else:  # a folder of anything else is never removed
        replaceable = path.is_dir() and all(e.name == "metadata.yaml" or e.suffix == ".mcap" for e in path.iterdir())
    if not replaceable:
        raise RecordingError(f"{path} is not a bag of this form and is not replaced: give another name")


def read_bag(path: str | Path, recover: bool = False) -> Recording:
    """The recording in a rosbag2 folder or in one .mcap file, ours or recorded from a replay's topics.

    Where the bag has `/samples`, as `record` writes them, each number of any pass is one sample. Else channels are
    aligned by their messages' header stamps; where one lacks a stamp of the others its value is NaN. Notes say what is
    missing. With `recover`, a bag that was cut off gives what is intact. Where it was recorded in a namespace see
    `bag_namespace`.

    Raises RecordingError with one line that names the file, the topic and what to do.
    """
    path, wanted = parted(path)
    topics, broken = read_topics(bag_files(path), is_read)
    namespace, topics = own_topics(path, topics, wanted)
    path = Path(f"{path}#{namespace.strip('/')}") if namespace else path  # as errors name it
    if broken and not (recover and TEST_TOPIC in topics):
        way_out = (
            f"`import {path} --recover --to NEW` copies what is intact" if TEST_TOPIC in topics else "nothing is intact"
        )
        raise RecordingError(f"{path}: {broken}: {way_out}")
    test, time_zero, expected = _read_test(path, topics)
    notes = [f"recovered from a damaged bag: {broken}"] if broken else []
    samples = topics.get(SAMPLES_TOPIC)
    if samples is not None and samples.messages:
        times, values = read_samples(f"{path}: topic {SAMPLES_TOPIC}", samples, len(test.channels), expected)
    else:
        test, stamps, values = _read_channels(path, topics, test, notes)
        times = stamps - time_zero
    if len(times) < expected:
        notes.append(f"{len(times)} of the {expected} samples that the test had are in the bag")
    try:
        recording = Recording(replace(test, notes=test.notes + tuple(notes)), times, values)
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from None
    if not recording.has_values:
        raise RecordingError(f"{path}: no channel has a valid value at any sample: there is nothing in it to use")
    return recording


def _read_channels(
    path: Path, topics: dict[str, Topic], test: Test, notes: list[str]
) -> tuple[Test, np.ndarray, np.ndarray]:
    """The test with the channels that are there, their stamps (n,) ns and values (n, channels)."""
    columns, kept = {}, []
    for channel in test.channels:
        topic = topics.get(CHANNEL_TOPICS + channel.name)
        if topic is None or not topic.messages:
            notes.append(f"{channel.name}: left out, the bag has no message of it")
            continue
        columns[channel.name] = _read_channel(path, channel, topic)
        kept.append(channel)
    for name in topics:
        if name.startswith(CHANNEL_TOPICS) and name.removeprefix(CHANNEL_TOPICS) not in test.channel_names:
            notes.append(f"{name}: left out, {TEST_TOPIC} does not list it")
    if not kept:
        raise RecordingError(
            f"{path}: has no samples: no message on {SAMPLES_TOPIC}, nor on any {CHANNEL_TOPICS}<name> that "
            f"{TEST_TOPIC} lists"
        )
    return replace(test, channels=tuple(kept)), *_align(path, kept, columns, notes)


def _read_test(path: Path, topics: dict[str, Topic]) -> tuple[Test, int, int]:
    """The test, the stamp of its impact in ns, and how many samples it had."""
    topic = topics.get(TEST_TOPIC)
    if topic is None or not topic.messages:
        found = ", ".join([*sorted(topics)[:8], *(["..."] if len(topics) > 8 else [])]) or "none"
        raise RecordingError(
            f"{path}: not a crash test's bag: it has no {TEST_TOPIC} topic (topics: {found}); "
            "bags with it are written by `import`, from CSV with YAML for instance"
        )
    if topic.type != TEST_TYPE:
        raise RecordingError(f"{path}: topic {TEST_TOPIC} must be {TEST_TYPE}, found {topic.type}")
    try:
        return decode_test(topic.messages[-1])
    except RecordingError as error:
        raise RecordingError(f"{path}: topic {TEST_TOPIC}: {error}") from None


def _read_channel(path: Path, channel: Channel, topic: Topic) -> tuple[np.ndarray, np.ndarray]:
    where = f"{path}: topic {CHANNEL_TOPICS}{channel.name}"
    expected = CARRIERS[channel.quantity].type
    if topic.type != expected:
        raise RecordingError(f"{where}: {channel.quantity} travels as {expected}, found {topic.type}: not readable")
    try:
        stamps, values = decode(channel, topic.messages)
    except RecordingError as error:
        raise RecordingError(f"{where}: {error}") from None
    backwards = np.flatnonzero(np.diff(stamps) <= 0)
    if len(backwards):
        k = int(backwards[0]) + 1
        raise RecordingError(
            f"{where}: stamps must increase, but message {k} at {stamps[k] / SECOND:.6f} s follows "
            f"{stamps[k - 1] / SECOND:.6f} s; a bag without {SAMPLES_TOPIC} must hold one pass over the test"
        )
    return stamps, values


def _align(
    path: Path, channels: Sequence[Channel], columns: dict[str, tuple[np.ndarray, np.ndarray]], notes: list[str]
) -> tuple[np.ndarray, np.ndarray]:
    """Stamps that any channel has (n,) int64 ns, and the values (n, channels), NaN where a channel has none."""
    stamps = np.unique(np.concatenate([columns[channel.name][0] for channel in channels]))
    if wrong := limits.size_wrong(len(stamps), len(channels)):
        raise RecordingError(f"{path}: {wrong}")
    values = np.full((len(stamps), len(channels)), np.nan)
    lost: dict[int, list[str]] = {}
    for k, channel in enumerate(channels):
        own, column = columns[channel.name]
        within = int(np.count_nonzero((stamps >= own[0]) & (stamps <= own[-1])))
        if len(own) < SAME_CLOCK * within:
            raise RecordingError(
                f"{path}: mixed sample rates: topic {CHANNEL_TOPICS}{channel.name} has {len(own)} stamps where the "
                f"channels together have {within}; bring all channels to one time base and import again"
            )
        values[np.searchsorted(stamps, own), k] = column
        lost.setdefault(len(stamps) - len(own), []).append(channel.name)
    notes += [f"no message at {n} of {len(stamps)} stamps, NaN there: {', '.join(c)}" for n, c in lost.items() if n]
    return stamps, values
