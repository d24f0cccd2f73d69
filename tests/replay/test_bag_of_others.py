"""Bags that others wrote, lost something or were damaged: what is there is read, what is wrong is said in one line."""

import numpy as np
import pytest
from helpers_bag import CHANNELS, SECOND, SMALL, assert_same, some_recording, topics_of, write_messages
from mcap.writer import Writer as McapWriter
from numpy.testing import assert_array_equal

from crash_replay.bag import CHANNEL_TOPICS, read_bag, write_bag
from crash_replay.channel_messages import CARRIERS, encode
from crash_replay.recording import RecordingError


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
        "has no samples: no message on /samples, nor on any /channels/<name>"
    )


def test_not_a_bag(tmp_path):
    assert error(tmp_path / "nothing").startswith("there is no such bag")
    (tmp_path / "text.mcap").write_text("time,rib_ay\n")
    said = error(tmp_path / "text.mcap")
    assert said.startswith("not an MCAP file; `import SOURCE --to NEW.mcap` makes a bag of a CSV with its YAML")
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
