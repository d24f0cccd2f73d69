"""Bags: read back to the last bit, decoded by others too; nothing is replaced unasked."""

import hashlib
import subprocess
import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from helpers_bag import CHANNELS, SECOND, SMALL, assert_same, some_recording
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from numpy.testing import assert_array_equal
from rosbags.interfaces import QosDurability, QosReliability
from rosbags.rosbag2 import Reader

from crash_replay.bag import CHANNEL_TOPICS, read_bag, time_zero_ns, write_bag
from crash_replay.channel_messages import CARRIERS
from crash_replay.message_types import typestore
from crash_replay.recording import Channel, Recording, RecordingError, Test


@pytest.mark.parametrize("name", ["bag", "bag.mcap"])
def test_read_gives_what_was_written(tmp_path, name):
    written = some_recording()
    assert_same(read_bag(write_bag(written, tmp_path / "sub" / name)), written)
    assert sorted(p.name for p in (tmp_path / "sub").iterdir()) == [name]  # nothing left behind
    if name == "bag":
        assert sorted(p.name for p in (tmp_path / "sub/bag").iterdir()) == ["bag.mcap", "metadata.yaml"]


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    values=arrays(
        float, st.tuples(st.integers(1, 8), st.just(3)), elements=st.floats(-1e12, 1e12) | st.just(np.nan)
    ).filter(lambda values: np.isfinite(values).any()),
    first=st.integers(-3 * SECOND, 3 * SECOND),
    period=st.integers(1, 2 * SECOND),
)
def test_any_values_and_times_come_back(tmp_path, values, first, period):
    written = Recording(
        replace(some_recording().test, channels=CHANNELS[:3]), first + period * np.arange(len(values)), values
    )
    assert_same(read_bag(write_bag(written, tmp_path / "any.mcap", overwrite=True)), written)
    assert time_zero_ns(written) % SECOND == 0 and time_zero_ns(written) + first >= SECOND


@pytest.mark.parametrize("name", ["b", "b.mcap"])
def test_same_recording_gives_the_same_bytes(tmp_path, name):
    digests = set()
    for folder in ("one", "two"):
        path = write_bag(some_recording(), tmp_path / folder / name)
        files = sorted(path.iterdir()) if path.is_dir() else [path]
        digests.add(hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest())
    assert len(digests) == 1


def test_mcap_own_ros2_reader_decodes_every_topic(tmp_path):
    written = some_recording(20)
    zero = time_zero_ns(written)
    path = write_bag(written, tmp_path / "b.mcap")
    seen: dict[str, list] = {}
    with path.open("rb") as stream:
        for schema, channel, record, message in make_reader(
            stream, decoder_factories=[DecoderFactory()]
        ).iter_decoded_messages():
            seen.setdefault(channel.topic, []).append((record.log_time, schema.name, message))
    assert set(seen) == {"/test"} | {CHANNEL_TOPICS + channel.name for channel in CHANNELS}
    for k, channel in enumerate(CHANNELS):
        messages = seen[CHANNEL_TOPICS + channel.name]
        assert len(messages) == 20
        for (log_time, type_name, message), time_ns, value in zip(
            messages, written.time_ns, written.values[:, k], strict=True
        ):
            stamp = message.header.stamp.sec * SECOND + message.header.stamp.nanosec
            assert log_time == stamp == time_ns + zero and type_name == CARRIERS[channel.quantity].type
            assert message.header.frame_id == (channel.body or channel.name)
            vector = message
            for field in CARRIERS[channel.quantity].vector:
                vector = getattr(vector, field)
            components = {"x": vector.x, "y": vector.y, "z": vector.z}
            assert_array_equal(components.pop(channel.axis or "x"), value)
            assert set(components.values()) == {0.0}
    ((_, _, info),) = seen["/test"]
    assert (info.id, info.samples, info.sample_period) == ("T1", 20, pytest.approx(1e-4))
    assert info.time_zero.sec * SECOND + info.time_zero.nanosec == zero
    assert [(c.name, c.unit) for c in info.channels] == [(c.name, c.unit) for c in CHANNELS]


def test_rosbags_reads_it_and_the_test_is_latched(tmp_path):
    path = write_bag(some_recording(10), tmp_path / "b")
    with Reader(path) as reader:
        qos = {connection.topic: connection.ext.offered_qos_profiles[0] for connection in reader.connections}
        first = next(iter(reader.messages()))
        assert first[0].topic == "/test"  # a player sends it before the samples
        assert reader.message_count == 1 + 10 * len(CHANNELS)
        for connection, _, data in reader.messages():
            typestore().deserialize_cdr(data, connection.msgtype)
    assert qos["/test"].durability == QosDurability.TRANSIENT_LOCAL and qos["/test"].depth == 1
    other = qos[CHANNEL_TOPICS + CHANNELS[0].name]
    assert other.durability == QosDurability.VOLATILE and other.reliability == QosReliability.RELIABLE


def test_ros_itself_decodes_every_message(tmp_path):
    serialization = pytest.importorskip("rclpy.serialization")
    messages = pytest.importorskip("crash_msgs.msg")
    geometry = pytest.importorskip("geometry_msgs.msg")
    written = some_recording(5)
    types = {f"geometry_msgs/msg/{name}": getattr(geometry, name) for name in dir(geometry) if name.endswith("Stamped")}
    types["crash_msgs/msg/TestInfo"] = messages.TestInfo
    columns: dict[str, list] = {}
    with Reader(write_bag(written, tmp_path / "b")) as reader:
        for connection, _, data in reader.messages():
            message = serialization.deserialize_message(data, types[connection.msgtype])
            columns.setdefault(connection.topic, []).append(message)
    (info,) = columns["/test"]
    assert (info.title, list(info.bodies), list(info.notes)) == ("A title, größer", ["car", "door"], ["one", "two"])
    for k, channel in enumerate(CHANNELS):
        vectors = columns[CHANNEL_TOPICS + channel.name]
        for field in CARRIERS[channel.quantity].vector:
            vectors = [getattr(message, field) for message in vectors]
        assert_array_equal([getattr(vector, channel.axis or "x") for vector in vectors], written.values[:, k])


@pytest.mark.skipif(find_spec("rerun_cli") is None, reason="rerun's program is not installed")
def test_rerun_opens_it(tmp_path):
    path = write_bag(some_recording(40), tmp_path / "b.mcap")
    program = Path(find_spec("rerun_cli").origin).with_name("rerun")
    subprocess.run(
        [program, "mcap", "convert", path, "-o", tmp_path / "b.rrd"], check=True, capture_output=True, timeout=60
    )
    from rerun.chunk import RrdReader

    rows: dict[str, int] = {}
    for chunk in RrdReader(tmp_path / "b.rrd").stream():
        if "ros2_timestamp" in chunk.timeline_names:
            rows[chunk.entity_path] = rows.get(chunk.entity_path, 0) + chunk.to_record_batch().num_rows
    for channel in CHANNELS:
        assert rows[CHANNEL_TOPICS + channel.name] == 40


def calls_of_reading(path) -> int:
    """Python's calls, which are as many on every machine."""
    calls, before = [], sys.getprofile()
    sys.setprofile(lambda frame, event, argument: calls.append(1) if event == "call" else None)
    try:
        read_bag(path)
    finally:
        sys.setprofile(before)
    return len(calls)


def test_reading_takes_work_in_proportion_to_the_samples(tmp_path):
    """A whole test of 3500 instants is read so in 0.2 to 0.4 s on two shared cores."""
    few, many = (write_bag(some_recording(n, CHANNELS[:16]), tmp_path / f"{n}.mcap") for n in (200, 800))
    for_each = calls_of_reading(many) / 800
    assert for_each < 1.05 * calls_of_reading(few) / 200, "more for each sample, the more there are"
    assert for_each < 30 * 17, "for each channel's value, and the instant's own message, some thirty calls"


def test_names_that_are_no_topics_and_odd_axes_are_refused(tmp_path):
    for name in ("rib ay", "1rib", "a__b", "", "_hidden", "größe"):
        with pytest.raises(RecordingError, match="cannot be a ROS topic"):
            write_bag(some_recording(3, [Channel(name, "force")]), tmp_path / "b")
    with pytest.raises(RecordingError, match="channel f: axis must be x, y, z or empty, found 'q'"):
        write_bag(some_recording(3, [Channel("f", "force", axis="q")]), tmp_path / "b")
    with pytest.raises(RecordingError, match="has no channels"):
        write_bag(Recording(Test("T", ()), np.arange(3), np.zeros((3, 0))), tmp_path / "b")
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_replaced_unasked_and_only_bags_when_asked(tmp_path):
    write_bag(SMALL, tmp_path / "b")
    write_bag(SMALL, tmp_path / "b.mcap")
    for name in ("b", "b.mcap"):
        with pytest.raises(RecordingError, match="exists already.*--force"):
            write_bag(SMALL, tmp_path / name)
        write_bag(some_recording(5), tmp_path / name, overwrite=True)
        assert len(read_bag(tmp_path / name)) == 5
    (tmp_path / "data").mkdir()
    (tmp_path / "data/thesis.txt").write_text("keep me")
    (tmp_path / "file").write_text("keep me")
    for name in ("data", "file"):
        with pytest.raises(RecordingError, match="is not a bag of this form and is not replaced"):
            write_bag(SMALL, tmp_path / name, overwrite=True)
    assert (tmp_path / "data/thesis.txt").exists() and (tmp_path / "file").exists()


def test_bags_are_read_without_ros(tmp_path):
    """crash_replay.bag needs neither rclpy nor a built crash_msgs."""
    path = write_bag(some_recording(3), tmp_path / "b.mcap")
    script = (
        "import sys; sys.modules['rclpy'] = sys.modules['ament_index_python'] = None\n"
        f"from crash_replay.bag import read_bag; print(len(read_bag({str(path)!r})))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (0, "3\n"), done.stderr
