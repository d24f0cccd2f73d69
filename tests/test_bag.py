"""Bags: read back to the last bit, decoded by others too; what is wrong with one is said in a line."""

import hashlib
import subprocess
import sys
import time
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from mcap.reader import make_reader
from mcap.writer import Writer as McapWriter
from mcap_ros2.decoder import DecoderFactory
from numpy.testing import assert_array_equal
from rosbags.interfaces import QosDurability, QosReliability
from rosbags.rosbag2 import Reader, StoragePlugin, Writer

from crash_replay.bag import CHANNEL_TOPICS, read_bag, time_zero_ns, write_bag
from crash_replay.channel_messages import CARRIERS, encode
from crash_replay.message_types import encode_test
from crash_replay.message_types import typestore
from crash_replay.recording import Channel, Recording, RecordingError, Test

SECOND = 1_000_000_000
CHANNELS = tuple(
    Channel(f"{quantity}_{axis or 'none'}", quantity, body, axis, f"column {axis}")
    for quantity in CARRIERS
    for axis, body in (("x", "car"), ("y", ""), ("z", "driver_head"), ("", "car"))
)


def some_recording(samples=300, channels=CHANNELS, first=-50, period_ns=100_000):
    rng = np.random.default_rng(7)
    values = rng.normal(scale=1e3, size=(samples, len(channels)))
    values[samples // 3 :, 2 % len(channels)] = np.nan
    test = Test(
        "T1",
        tuple(channels),
        "A title, größer",
        "a source",
        {"car": 15.8, "door": 0.0},
        {"car": 0.0, "door": -0.02},
        ("one", "two"),
    )
    return Recording(test, (np.arange(samples, dtype=np.int64) + first) * period_ns, values)


def assert_same(read, written):
    assert read.test == written.test
    assert_array_equal(read.time_ns, written.time_ns)
    assert_array_equal(read.values, written.values)


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
        float, st.tuples(st.integers(1, 8), st.just(3)), elements=st.floats(allow_nan=True, allow_infinity=True)
    ),
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
        for (log_time, type_name, message), time_ns, value in zip(messages, written.time_ns, written.values[:, k]):
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


def test_a_whole_test_reads_fast(tmp_path):
    path = write_bag(some_recording(3500, CHANNELS[:16]), tmp_path / "b.mcap")
    start = time.perf_counter()
    read_bag(path)
    # 0.2 to 0.4 s on two shared cores; the bound leaves room for whatever else runs there
    assert time.perf_counter() - start < 2.0


# ---- bags that others wrote


def write_messages(path, recording, topics, zero=SECOND, test=True):
    """A bag with these (topic, type, stamps, messages) beside the recording's TestInfo."""
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        if test:
            connection = writer.add_connection("/test", "crash_msgs/msg/TestInfo", typestore=typestore())
            writer.write(connection, zero, encode_test(recording, zero))
        for name, type_name, stamps, messages in topics:
            connection = writer.add_connection(name, type_name, typestore=typestore())
            for stamp, message in zip(stamps, messages):
                writer.write(connection, int(stamp), message)
    return path


def topics_of(recording, keep=lambda k, i: True, shift=lambda k: 0, zero=SECOND):
    """The recording's own topics, with the samples i of channel k that `keep` keeps, at shifted stamps."""
    topics = []
    for k, channel in enumerate(recording.test.channels):
        chosen = [i for i in range(len(recording)) if keep(k, i)]
        stamps = recording.time_ns[chosen] + zero + shift(k)
        messages = encode(channel, stamps, recording.values[chosen, k])
        topics.append((CHANNEL_TOPICS + channel.name, CARRIERS[channel.quantity].type, stamps, messages))
    return topics


SMALL = some_recording(100, CHANNELS[:3], first=0)
SMALL = replace(SMALL, values=np.nan_to_num(SMALL.values))


def test_lost_messages_are_nan_and_said(tmp_path):
    path = write_messages(tmp_path / "b", SMALL, topics_of(SMALL, keep=lambda k, i: k != 1 or i not in (5, 6, 50)))
    read = read_bag(path)
    expected = SMALL.values.copy()
    expected[[5, 6, 50], 1] = np.nan
    assert_array_equal(read.values, expected)
    assert read.test.notes[2:] == ("no message at 3 of 100 stamps, NaN there: acceleration_y",)


def test_only_some_channels_recorded_and_others_added(tmp_path):
    topics = topics_of(SMALL)[:2]
    extra = (
        CHANNEL_TOPICS + "other",
        CARRIERS["force"].type,
        [SECOND],
        encode(CHANNELS[0], np.array([SECOND]), np.zeros(1)),
    )
    read = read_bag(write_messages(tmp_path / "b", SMALL, [*topics, extra]))
    assert read.test.channel_names == ("acceleration_x", "acceleration_y")
    assert read.test.notes[2:] == (
        "acceleration_z: left out, the bag has no message of it",
        "/channels/other: left out, /test does not list it",
    )


def test_folder_without_metadata_and_in_several_files(tmp_path):
    write_messages(tmp_path / "b", SMALL, topics_of(SMALL, keep=lambda k, i: i < 60))
    write_messages(tmp_path / "c", SMALL, topics_of(SMALL, keep=lambda k, i: i >= 60), test=False)
    (tmp_path / "b/metadata.yaml").unlink()
    (tmp_path / "b/b.mcap").rename(tmp_path / "b/b_9.mcap")
    (tmp_path / "c/c.mcap").rename(tmp_path / "b/b_10.mcap")
    assert_array_equal(read_bag(tmp_path / "b").values, SMALL.values)


# ---- what is wrong is said in one line


def error(path, **options):
    with pytest.raises(RecordingError) as raised:
        read_bag(path, **options)
    text = str(raised.value)
    assert "\n" not in text
    assert text.startswith(f"{path}")
    return text.removeprefix(f"{path}").removeprefix(": ")


def test_repeated_or_backward_stamps(tmp_path):
    twice = topics_of(SMALL)
    name, type_name, stamps, messages = twice[1]
    twice[1] = (name, type_name, [*stamps, stamps[-1]], [*messages, messages[40]])
    text = error(write_messages(tmp_path / "b", SMALL, twice))
    assert text.startswith(
        "topic /channels/acceleration_y: stamps must increase, but message 100 at 1.004000 s follows 1.009900 s"
    )


@pytest.mark.parametrize(
    "disturbed", [{"keep": lambda k, i: k != 2 or i % 10 == 0}, {"shift": lambda k: 30_000 * (k == 2)}]
)
def test_mixed_sample_rates(tmp_path, disturbed):
    text = error(write_messages(tmp_path / "b", SMALL, topics_of(SMALL, **disturbed)))
    assert text.startswith("mixed sample rates: topic /channels/acceleration_") and "one time base" in text


def test_wrong_type_and_foreign_bytes(tmp_path):
    name, _, stamps, messages = topics_of(SMALL)[0]
    text = error(write_messages(tmp_path / "b", SMALL, [(name, "geometry_msgs/msg/WrenchStamped", stamps, messages)]))
    assert text == (
        "topic /channels/acceleration_x: acceleration travels as geometry_msgs/msg/AccelStamped, "
        "found geometry_msgs/msg/WrenchStamped: not readable"
    )
    short = [(name, "geometry_msgs/msg/AccelStamped", stamps, [m[:30] for m in messages])]
    assert "expected geometry_msgs/msg/AccelStamped as little-endian CDR" in error(
        write_messages(tmp_path / "c", SMALL, short)
    )


def test_foreign_bag_lists_its_topics(tmp_path):
    text = error(write_messages(tmp_path / "b", SMALL, topics_of(SMALL), test=False))
    assert text.startswith("not a crash test's bag: it has no /test topic (topics: /channels/acceleration_x, ")
    assert "written by `import`" in text


def test_test_topic_of_another_type(tmp_path):
    with (tmp_path / "b.mcap").open("wb") as stream:
        writer = McapWriter(stream)
        writer.start("ros2")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        channel = writer.register_channel("/test", "cdr", schema)
        writer.add_message(channel, 1, b"\0\1\0\0", 1)
        writer.finish()
    assert error(tmp_path / "b.mcap") == "topic /test must be crash_msgs/msg/TestInfo, found std_msgs/msg/String"


def test_no_samples(tmp_path):
    assert error(write_messages(tmp_path / "b", SMALL, [])).startswith(
        "has no samples: no message on any /channels/<name>"
    )


def test_not_a_bag(tmp_path):
    assert error(tmp_path / "nothing").startswith("there is no such bag")
    (tmp_path / "text.mcap").write_text("time,rib_ay\n")
    assert error(tmp_path / "text.mcap") == "not an MCAP file"
    (tmp_path / "folder").mkdir()
    assert error(tmp_path / "folder").startswith("no .mcap file in it; expected a rosbag2 folder")
    (tmp_path / "folder/x.db3").touch()
    assert "rosbags-convert" in error(tmp_path / "folder")


def test_cut_off_bag_says_so_and_what_is_intact_can_be_recovered(tmp_path):
    written = some_recording(1500)
    whole = write_bag(written, tmp_path / "b.mcap").read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[: int(0.7 * len(whole))])
    text = error(cut)
    assert (
        text.startswith("cut off or damaged after ")
        and f"`import {cut} --recover --to NEW` copies what is intact" in text
    )
    read = read_bag(cut, recover=True)
    n = len(read)
    assert 500 < n < 1500
    assert_array_equal(read.time_ns, written.time_ns[:n])
    assert_array_equal(read.values[:-1], written.values[: n - 1])  # the last instant may lack channels
    assert read.test.notes[2].startswith("recovered from a damaged bag: cut off or damaged after ")
    assert read.test.notes[-1] == f"{n} of the 1500 samples that the test had are in the bag"


def test_a_bag_cut_anywhere_never_passes_for_whole(tmp_path):
    written = some_recording(40, CHANNELS[:2])
    whole = write_bag(written, tmp_path / "b.mcap").read_bytes()
    cut = tmp_path / "cut.mcap"
    for length in range(0, len(whole), 37):
        cut.write_bytes(whole[:length])
        assert error(cut).startswith("cut off or damaged after ")


def test_a_damaged_byte_is_noticed_or_harmless(tmp_path):
    written = some_recording(40, CHANNELS[:2])
    whole = write_bag(written, tmp_path / "b.mcap").read_bytes()
    broken = tmp_path / "broken.mcap"
    noticed = 0
    for at in range(8, len(whole), 61):
        data = bytearray(whole)
        data[at] ^= 0xFF
        broken.write_bytes(data)
        try:
            read = read_bag(broken)
        except RecordingError as raised:
            assert str(raised).startswith(f"{broken}: cut off or damaged after ")
            noticed += 1
        else:
            assert_same(read, written)  # a byte of the index, which is not used here
    assert noticed > 80


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
