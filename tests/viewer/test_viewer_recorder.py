"""The viewer's recorder, without ROS: passes over a test, those who come late, and all that goes wrong."""

import os
import signal
import socket
import subprocess
import time
from collections import Counter
from pathlib import Path
from threading import Event

import helpers_viewer as crash_data
import numpy as np
import pytest
import rerun as rr
from helpers_viewer import NAMES, column, feed, recorder, rows, series, settle, two_streams
from helpers_waiting import PATIENCE
from rerun.chunk import RrdReader

from crash_estimator.viewer.blocks import ForceBlock, ParameterBlock, said_of
from crash_estimator.viewer.native import viewer_binary
from crash_estimator.viewer.passes import Pass
from crash_estimator.viewer.pen import Pen
from crash_estimator.viewer.sinks import usable_port

pytestmark = pytest.mark.usefixtures("strict")


def test_a_killed_viewer_disturbs_nothing(crash, streams, tmp_path):
    path = tmp_path / "killed.rrd"
    target = recorder(path)
    command = [
        viewer_binary(),
        "--headless",
        "--bind=127.0.0.1",
        f"--port={usable_port(0)}",
        "--connect",
        target.sinks.url,
    ]
    viewer = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    time.sleep(1.0)
    died_early = viewer.poll() is not None
    half = {name: stream[: len(stream) // 2] for name, stream in streams.items()}
    rest = {name: stream[len(stream) // 2 :] for name, stream in streams.items()}
    feed(target, crash, half)
    os.kill(viewer.pid, signal.SIGKILL) if not died_early else None
    viewer.wait()
    for name in NAMES:
        for block in rest[name]:
            target.put(lambda block=block: block)
    settle(target)
    target.close()
    assert rows(path)["/signal/cab/measured"] == len(crash.time_ns)
    if died_early:
        pytest.skip("the viewer itself cannot run here (see tools/screenshot-libs): only its absence was tried")


def test_a_full_queue_makes_curves_coarser_and_nobody_waits(crash, tmp_path):
    streams = two_streams(crash, size=1)
    said = []
    target = recorder(tmp_path / "coarse.rrd", limit=600, say=said.append)
    target.put(lambda: crash_data.test_block(crash))
    goes_on, gone_on = Event(), []
    target.put(lambda: gone_on.append(goes_on.wait(PATIENCE)))  # Rerun is held up, as by a slow disk
    for i in range(len(streams["mrls"])):
        for name in NAMES:
            target.put(lambda block=streams[name][i]: block, stream=(name, type(streams[name][i])))
    event = crash_data.events(crash, "mrls")[0]
    target.put(lambda: event)
    assert not gone_on, "nobody has waited for it"
    goes_on.set()
    settle(target)
    target.close(incomplete="a reason")
    assert target.dropped > 1000
    assert target.faults == [
        f"{target.dropped} messages were left out of the picture: they came faster than it can be drawn"
    ]
    assert f"**incomplete:** a reason; {target.dropped} messages" in last_summary(tmp_path / "coarse.rrd")
    for name in NAMES:  # each of them is there to its end
        times, _ = series(tmp_path / "coarse.rrd", f"/signal/cab/model/{name}", "Scalars:scalars")
        assert 50 < len(times) < len(crash.time_ns)
        assert np.diff(times, prepend=crash.time_ns[0], append=crash.time_ns[-1]).max() < 10_000_000  # no hole
    assert rows(tmp_path / "coarse.rrd")["/event/mrls"] == 1
    assert said == []


def last_summary(path: Path) -> str:
    """The table as it stands at the end."""
    _, texts = column(path, "/summary", "TextDocument:text")
    return str(texts[-1][0])


def test_a_file_that_was_not_written_to_its_end_is_a_fault(crash, streams, tmp_path, monkeypatch):
    path = tmp_path / "cut.rrd"
    target = recorder(path)
    feed(target, crash, streams)
    disconnect = rr.RecordingStream.disconnect

    def disk_is_full(recording):
        disconnect(recording)
        path.write_bytes(path.read_bytes()[:-20])

    monkeypatch.setattr(rr.RecordingStream, "disconnect", disk_is_full)
    target.close()
    assert target.faults == [f"{path} was not written to its end: is the disk full?"]


def test_what_cannot_be_drawn_is_said_once_and_the_rest_goes_on(crash, streams, tmp_path):
    said = []
    target = recorder(tmp_path / "bad.rrd", say=said.append)

    def bad():
        raise ValueError("cannot reshape array of size 3 into shape (1,2)")

    target.put(bad)
    target.put(bad)
    feed(target, crash, streams)
    target.close()
    assert said == ["the viewer leaves something out: ValueError: cannot reshape array of size 3 into shape (1,2)"]
    assert target.faults == ["left out: ValueError: cannot reshape array of size 3 into shape (1,2)"]
    assert rows(tmp_path / "bad.rrd")["/signal/cab/measured"] == len(crash.time_ns)


def test_an_estimator_that_contradicts_itself_does_not_harm_the_others(crash, streams, tmp_path):
    said = []
    target = recorder(tmp_path / "one.rrd", say=said.append)
    nonsense = [b._replace(between=("cab-moon",) * 3) if isinstance(b, ForceBlock) else b for b in streams["ckf"]]
    feed(target, crash, {"mrls": streams["mrls"], "ckf": nonsense})
    target.close()
    found = rows(tmp_path / "one.rrd")
    assert found["/signal/cab/model/mrls"] == len(crash.time_ns)
    assert "/signal/cab/model/ckf" not in found
    assert len(said) == 1
    assert "'cab-moon': expected two of the bodies cab, engine, barrier" in said[0]


def test_values_that_are_not_finite_leave_gaps_only(crash, streams, tmp_path):
    said = []
    target = recorder(tmp_path / "gaps.rrd", say=said.append)
    spoiled = []
    for block in streams["mrls"]:
        values = {name: getattr(block, name).copy() for name in said_of(block) if getattr(block, name).dtype == float}
        for table in values.values():
            table[3], table[7] = np.nan, np.inf
        spoiled.append(block._replace(**values))
    feed(target, crash, {"mrls": spoiled, "ckf": streams["ckf"]})
    target.close()
    assert said == []
    assert rows(tmp_path / "gaps.rrd")["/signal/cab/model/mrls"] == len(crash.time_ns)
    _, cab = series(tmp_path / "gaps.rrd", "/motion/mrls/body/cab", "Transform3D:translation")
    assert np.abs(cab).max() < 10


def test_a_model_without_springs_is_shown_all_the_same(crash, streams, tmp_path):
    def bare(block):
        if isinstance(block, ForceBlock):
            n = len(block.time_ns)
            return block._replace(
                element=(), between=(), crush=np.empty((n, 0)), force=np.empty((n, 0)), state=np.empty((n, 0), int)
            )
        if isinstance(block, ParameterBlock):
            n = len(block.time_ns)
            return block._replace(
                name=(), unit=(), value=np.empty((n, 0)), std=np.empty((n, 0)), status=np.empty((n, 0), int)
            )
        return block

    said = []
    target = recorder(tmp_path / "bare.rrd", say=said.append)
    feed(target, crash, {name: [bare(block) for block in stream] for name, stream in streams.items()})
    target.close()
    assert said == []
    assert rows(tmp_path / "bare.rrd")["/signal/cab/model/mrls"] == len(crash.time_ns)


def test_each_pass_is_a_recording_and_one_complete_pass_in_a_file_is_enough(crash, streams, tmp_path):
    path = tmp_path / "loop.rrd"
    target = recorder(path)
    half = {name: stream[: len(stream) // 2] for name, stream in streams.items()}
    feed(target, crash, half, run=0)  # a seek interrupts it
    feed_run = {name: [b._replace(run=1) for b in stream] for name, stream in streams.items()}
    for run in (1, 2):
        for i in range(len(feed_run["mrls"])):
            for name in NAMES:
                target.put(lambda block=feed_run[name][i], run=run: block._replace(run=run))
        settle(target)
    lines = target.close()
    second = tmp_path / "loop-2.rrd"
    assert sorted(tmp_path.iterdir()) == [second, path]
    assert lines[0].startswith(f"wrote {path}: mrls 750 of 1500 samples")
    assert lines[1].startswith(f"wrote {second}: mrls 1500 of 1500 samples")
    assert rows(path)["/signal/cab/measured"] == 750
    assert rows(second)["/signal/cab/measured"] == 1500


def test_a_pass_is_complete_when_the_forces_are_drawn_too(crash, streams, tmp_path):
    """After a rush they come later than the rest."""
    path = tmp_path / "forces.rrd"
    target = recorder(path)
    late = [block for stream in streams.values() for block in stream[-10:] if isinstance(block, ForceBlock)]
    in_time = {name: [b for b in stream if not any(b is after for after in late)] for name, stream in streams.items()}
    feed(target, crash, in_time)
    assert late and not target.complete
    for block in late:
        target.put(lambda block=block: block)
    settle(target)
    assert target.complete
    assert target.close()[0].startswith(f"wrote {path}: mrls 1500 of 1500 samples")


def test_a_replay_started_again_does_not_go_on_in_the_old_recording(crash, streams, tmp_path):
    target = recorder(tmp_path / "again.rrd")
    half = {name: stream[: len(stream) // 2] for name, stream in streams.items()}
    feed(target, crash, half)
    feed(target, crash, streams)  # sends the test again, and run 0 again
    target.close()
    assert rows(tmp_path / "again.rrd")["/signal/cab/measured"] == 750
    assert rows(tmp_path / "again-2.rrd")["/signal/cab/measured"] == 1500


def test_who_joins_late_gets_its_place_beside_the_others(crash, streams, tmp_path, monkeypatch):
    monkeypatch.setattr("crash_estimator.viewer.passes.PATIENCE", 0.2)
    path = tmp_path / "late.rrd"
    target = recorder(path)
    target.put(lambda: crash_data.test_block(crash))
    for block in streams["mrls"]:
        target.put(lambda block=block: block)
    time.sleep(0.6)
    settle(target)
    for block in streams["ckf"]:
        target.put(lambda block=block: block)
    settle(target)
    target.close()
    found = rows(path)
    assert found["/signal/cab/model/mrls"] == found["/signal/cab/model/ckf"] == 1500
    assert 2 <= len(RrdReader(path).blueprints()) <= 6, "each with what was known then"
    times, cab = series(path, "/motion/mrls/body/cab", "Transform3D:translation")
    times, other = series(path, "/motion/ckf/body/cab", "Transform3D:translation")
    assert other[-1, 1] > cab[-1, 1]  # its lane is below


def test_a_port_in_use_is_not_taken():
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        taken = other.getsockname()[1]
        assert usable_port(taken) not in (0, taken)
    assert usable_port(taken) == taken


def test_what_is_written_grows_with_the_lines_and_not_with_the_messages(crash, tmp_path, monkeypatch):
    """A message for each sample is drawn in as few columns as one for fifty samples."""
    counts = Counter()
    columns, write = Pen.columns, Pass.write

    def counted_columns(pen, entity, time_ns, values):
        counts["columns"] += 1
        columns(pen, entity, time_ns, values)

    def counted_write(pass_, items):
        counts["batches"] += bool(items)
        write(pass_, items)

    monkeypatch.setattr(Pen, "columns", counted_columns)
    monkeypatch.setattr(Pass, "write", counted_write)
    per_batch = []
    for size in (1, 50):
        counts.clear()
        target = recorder(tmp_path / f"{size}.rrd")
        feed(target, crash, two_streams(crash, size=size), batches=3)
        target.close()
        per_batch.append(counts["columns"] / counts["batches"])
    assert per_batch[0] <= 1.1 * per_batch[1]  # 99 each; 750 messages of one sample are a batch
