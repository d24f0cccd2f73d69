"""Bags that were recorded in a namespace, or in several: read, told apart, and never written onto."""

import subprocess
import sys

import pytest
from helpers_bag import SECOND, SMALL, assert_same, some_recording, topics_of
from rosbags.rosbag2 import StoragePlugin, Writer

from crash_replay.bag import read_bag
from crash_replay.message_types import encode_test, typestore
from crash_replay.output import OutputError, check_outputs
from crash_replay.readers import is_bag, name_of, read_source
from crash_replay.recording import RecordingError

OTHER = some_recording(60, SMALL.test.channels, first=0)


def recorded(path, **recordings):
    """As `ros2 bag record` does, of replays in these namespaces ("" for none)."""
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for name, recording in recordings.items():
            namespace = "" if name == "root" else f"/{name}"
            test = writer.add_connection(f"{namespace}/test", "crash_msgs/msg/TestInfo", typestore=typestore())
            writer.write(test, SECOND, encode_test(recording, SECOND))
            for topic, kind, stamps, messages in topics_of(recording):
                connection = writer.add_connection(namespace + topic, kind, typestore=typestore())
                for stamp, message in zip(stamps, messages):
                    writer.write(connection, int(stamp), message)
    return path


@pytest.mark.parametrize("namespace", ["sled_a", "lab/sled_a"])
def test_what_was_recorded_in_a_namespace_is_read_without_a_word(tmp_path, namespace):
    assert_same(read_bag(recorded(tmp_path / "b", **{namespace: SMALL})), SMALL)


def test_of_several_one_is_named(tmp_path):
    bag = recorded(tmp_path / "b", sled_a=SMALL, root=OTHER)
    assert_same(read_source(f"{bag}#sled_a"), SMALL)
    assert_same(read_source(f"{bag}#/sled_a/"), SMALL)
    assert_same(read_source(f"{bag}#/"), OTHER)
    assert is_bag(f"{bag}#sled_a") and name_of(f"{bag}#sled_a") == "b-sled_a"


def test_which_one_has_to_be_said(tmp_path):
    bag = recorded(tmp_path / "b", sled_a=SMALL, root=OTHER)
    with pytest.raises(RecordingError, match=f"holds tests of 2 namespaces; say which one: {bag}#/, {bag}#sled_a$"):
        read_source(bag)
    with pytest.raises(
        RecordingError, match=f"no test of the namespace /sled_b is in it; there are: {bag}#/, {bag}#sle"
    ):
        read_source(f"{bag}#sled_b")


def test_a_file_with_a_hash_in_its_name_is_that_file(tmp_path):
    assert_same(read_source(recorded(tmp_path / "b#1", root=SMALL)), SMALL)


def test_an_error_names_the_namespace(tmp_path):
    bag = tmp_path / "b"
    with Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        test = writer.add_connection("/sled_a/test", "crash_msgs/msg/TestInfo", typestore=typestore())
        writer.write(test, SECOND, encode_test(SMALL, SECOND))
    with pytest.raises(RecordingError, match=f"{bag}#sled_a: has no samples"):
        read_bag(bag)


def test_the_bag_is_an_input_whichever_test_of_it_is_read(tmp_path):
    bag = recorded(tmp_path / "b", sled_a=SMALL)
    with pytest.raises(OutputError, match="lies in .* which this command reads"):
        check_outputs({"--json": bag / "out.json"}, [f"{bag}#sled_a"])


def test_import_takes_one_out_of_several(tmp_path):
    bag, single = recorded(tmp_path / "b", sled_a=SMALL, sled_b=OTHER), tmp_path / "a.mcap"
    command = [sys.executable, "-m", "crash_replay.import_command", f"{bag}#sled_a", "--to", str(single)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert_same(read_bag(single), SMALL)
