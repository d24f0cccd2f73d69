"""The viewer node in a process of its own: what estimators publish is in its file, however it is ended."""

import signal
import subprocess
import time
from array import array
from collections.abc import Callable, Iterator
from pathlib import Path

import helpers_viewer as crash_data
import numpy as np
import pytest
import rclpy
from crash_msgs import msg
from helpers_domain import own_domain
from helpers_viewer import start_viewer as start
from helpers_waiting import PATIENCE
from numpy.testing import assert_array_equal
from rclpy.node import Node
from rerun.chunk import RrdReader

from crash_estimator.demo.children import POLITE
from crash_estimator.nodes import viewer_messages
from crash_estimator.viewer.blocks import Block, ForceBlock, ParameterBlock, ResidualBlock
from crash_replay.middleware import prepare_middleware
from crash_replay.qos import LATCHED, STREAM
from crash_replay.recording import RecordingError

NAMES = ("mrls", "ckf")
SAMPLES = 240
"""Enough for every view; each comes in three messages of each estimator and takes some 2 ms to be drawn."""
FINISHED = msg.ReplayState(state=msg.ReplayState.FINISHED, number=SAMPLES, total=SAMPLES)
TOPIC_OF = {ParameterBlock: "block/parameters", ResidualBlock: "block/residuals", ForceBlock: "forces"}


def message_of(block: Block) -> msg.ParametersBlock | msg.ResidualsBlock | msg.Forces:
    """The message that an estimator would send: every field that message and block have in common."""
    message = viewer_messages.BLOCK_OF[TOPIC_OF[type(block)]][0]()
    for field, kind in message.get_fields_and_field_types().items():
        if not hasattr(block, field):
            continue
        value = getattr(block, field)
        if isinstance(value, np.ndarray):
            code = {"sequence<double>": "d", "sequence<int64>": "q", "sequence<uint8>": "B"}[kind]
            value = array(code, np.ascontiguousarray(value).tobytes())
        setattr(message, field, list(value) if isinstance(value, tuple) else value)
    return message


class Stage(Node):
    """Stands in for replay and estimators."""

    def __init__(self) -> None:
        super().__init__("stage")
        kinds = {topic: kind for topic, (kind, _) in viewer_messages.BLOCK_OF.items()}
        self.out = {(n, t): self.create_publisher(k, f"{n}/{t}", STREAM) for n in NAMES for t, k in kinds.items()}
        self.test = self.create_publisher(msg.TestInfo, "test", LATCHED)
        self.state = self.create_publisher(msg.ReplayState, "replay_state", LATCHED)
        self.samples = self.create_publisher(msg.Samples, "samples", STREAM)
        self.words: list[msg.Attendance] = []
        self.create_subscription(msg.Attendance, "attendance", self.words.append, LATCHED)

    def viewer_has_all(self) -> bool:
        """Whether the viewer says that it has got and drawn everything, however slow the machine is."""
        rclpy.spin_once(self, timeout_sec=0)
        return bool(self.words) and self.words[-1].done

    def play(self, crash: crash_data.Crash, streams: dict[str, list[Block]]) -> None:
        """Wait for the viewer as a replay does, then send everything as fast as it goes."""
        samples, period = len(crash.time_ns), 1e-4
        self.test.publish(msg.TestInfo(id="two-mass", title="a test", samples=samples, sample_period=period))
        wait_until(lambda: self.samples.get_subscription_count() == 1, "the viewer is to be counted as a subscriber")
        self.samples.publish(msg.Samples())
        for i in range(len(streams[NAMES[0]])):
            for name in NAMES:
                block = streams[name][i]
                self.out[name, TOPIC_OF[type(block)]].publish(message_of(block))
        for name in NAMES:
            for event in crash_data.events(crash, name):
                self.out[name, "events"].publish(
                    msg.Event(
                        number=event.number,
                        time=float(event.time),
                        kind=event.kind,
                        target=event.target,
                        text=event.text,
                    )
                )


def wait_until(done: Callable[[], bool], what: str, patience: float = PATIENCE) -> None:
    deadline = time.monotonic() + patience
    while not done():
        assert time.monotonic() < deadline, f"waited {patience:g} s in vain: {what}"
        time.sleep(0.02)


@pytest.fixture
def stage(monkeypatch) -> Iterator[Stage]:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(own_domain()))
    prepare_middleware()
    rclpy.init()
    node = Stage()
    yield node
    node.destroy_node()
    rclpy.shutdown()


@pytest.fixture(scope="module")
def crash() -> crash_data.Crash:
    return crash_data.simulate(n=SAMPLES, pre=50)


@pytest.fixture(scope="module")
def streams(crash) -> dict[str, list[Block]]:
    return {name: crash_data.estimates(crash, name, size=1, seed=k) for k, name in enumerate(NAMES)}


def end(viewer: subprocess.Popen, timeout: float, status: int = 0) -> tuple[str, str]:
    try:
        output, errors = viewer.communicate(timeout=timeout)
    except subprocess.TimeoutExpired:
        viewer.kill()
        pytest.fail(f"the viewer has not ended within {timeout:g} s, saying:\n{''.join(viewer.communicate())}")
    assert viewer.returncode == status, errors
    assert "Traceback" not in errors
    return output, errors


def whole(*names: str) -> str:
    """What is said of estimators that were seen to the end."""
    return ", ".join(f"{name} {SAMPLES} of {SAMPLES} samples" for name in names)


def drawn(rrd: Path, entity: str, component: bytes) -> np.ndarray:
    """A series in order of time."""
    rows = []
    for chunk in RrdReader(rrd).stream():
        if chunk.entity_path == entity and not chunk.is_static:
            batch = chunk.to_record_batch()
            times = batch.column("crash_time").cast("int64").to_pylist()
            for field, data in zip(batch.schema, batch.columns):
                if (field.metadata or {}).get(b"rerun:component") == component:
                    rows += zip(times, (row[0] for row in data.to_pylist()))
    return np.array([value for _, value in sorted(rows)])


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_it_with_everything_in_the_file(stage, crash, streams, tmp_path, number):
    rrd = tmp_path / "signal.rrd"
    viewer = start(rrd, estimators="[mrls, ckf]")
    stage.play(crash, streams)
    wait_until(stage.viewer_has_all, "the viewer says that it has all")
    viewer.send_signal(number)
    output, errors = end(viewer, timeout=POLITE)
    assert output == f"wrote {rrd}: {whole(*NAMES)}\n"
    assert "rerun --connect rerun+http://127.0.0.1:" in errors
    assert f"writing {rrd}" in errors
    assert rrd.read_bytes()[-12:-4] == b"RRF2FOOT"
    predicted = np.concatenate([b.predicted[:, 2] for b in streams["ckf"] if isinstance(b, ResidualBlock)])
    assert_array_equal(drawn(rrd, "/signal/barrier/model/ckf", b"Scalars:scalars"), predicted * 1e-3)
    assert len(drawn(rrd, "/event/mrls", b"TextLog:text")) == 6


def test_it_finds_the_estimators_and_ends_with_the_replay(stage, crash, streams, tmp_path, monkeypatch):
    """Though its window cannot open: that is said, and disturbs nothing."""
    monkeypatch.setenv("DISPLAY", ":97")  # where no X server is
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    rrd = tmp_path / "found.rrd"
    viewer = start(rrd, open="true", exit_when_finished="true")
    stage.play(crash, streams)
    time.sleep(1.0)
    stage.state.publish(FINISHED)
    output, errors = end(viewer, timeout=PATIENCE)
    assert "viewer opened on rerun+http://127.0.0.1:" in errors
    assert "could not run; look at it live with: rerun --connect rerun+http://127.0.0.1:" in errors
    assert output == f"wrote {rrd}: {whole(*sorted(NAMES))}\n"


def test_it_ends_at_once_where_nothing_was_played(stage, tmp_path):
    viewer = start(tmp_path / "empty.rrd", estimators="[mrls]")
    wait_until(lambda: stage.out["mrls", "forces"].get_subscription_count() == 1, "the viewer subscribes")
    viewer.send_signal(signal.SIGTERM)
    output, _ = end(viewer, timeout=POLITE)
    assert output == ""


def test_what_did_not_come_is_said_and_is_the_exit_status(stage, crash, streams, tmp_path):
    rrd = tmp_path / "hole.rrd"
    viewer = start(rrd, estimators="[mrls, ckf]", exit_when_finished="true")
    missed = streams["mrls"][60]
    half = {name: [block for block in streams[name] if block is not missed] for name in NAMES}
    half["ckf"] = half["ckf"][: len(half["mrls"])]
    stage.play(crash, half)
    stage.state.publish(FINISHED)
    output, errors = end(viewer, timeout=PATIENCE, status=1)
    (line,) = [line for line in errors.splitlines() if line.startswith("incomplete: ")]
    assert "mrls 239 of 240 samples (nobody can give them again)" in line and "ckf 239 of 240 samples" in line
    assert output.startswith(f"wrote {rrd}: ")


def test_a_signal_before_the_end_is_said_to_be_the_reason(stage, crash, streams, tmp_path):
    viewer = start(tmp_path / "early.rrd", estimators="[mrls, ckf]")
    stage.play(crash, {name: stream[:90] for name, stream in streams.items()})
    so_far = {"number": 30, "total": SAMPLES}
    stage.state.publish(msg.ReplayState(state=msg.ReplayState.FINISHED, **so_far))
    wait_until(stage.viewer_has_all, "the viewer says that it has what was sent")
    stage.state.publish(msg.ReplayState(state=msg.ReplayState.PLAYING, **so_far))
    wait_until(lambda: not stage.viewer_has_all(), "the viewer hears that more is to come")
    viewer.send_signal(signal.SIGTERM)
    _, errors = end(viewer, timeout=POLITE, status=1)
    assert errors.splitlines()[-1].startswith("incomplete: mrls 30 of 240 samples")
    assert errors.splitlines()[-1].endswith("ended before the rest came")


def test_a_file_that_cannot_be_written_is_one_line(stage, tmp_path):
    (tmp_path / "file").write_text("")
    viewer = start(tmp_path / "file" / "x.rrd")
    _, errors = viewer.communicate(timeout=PATIENCE)
    assert viewer.returncode == 1
    complaint = [line for line in errors.splitlines() if not line.startswith("[INFO]")]
    assert len(complaint) == 1
    assert complaint[0].startswith("error: ") and str(tmp_path / "file") in complaint[0]


def test_a_message_whose_lengths_do_not_fit_is_refused(streams):
    message = message_of(streams["mrls"][0])
    message.value = array("d", [1.0, 2.0])
    with pytest.raises(RecordingError, match=r"value: expected \d+ values .* found 2"):
        viewer_messages.parameter_block("mrls", message)


def test_messages_and_blocks_say_the_same(streams):
    for block in streams["mrls"][:3]:
        again = viewer_messages.BLOCK_OF[TOPIC_OF[type(block)]][1]("mrls", message_of(block))
        for field in block._fields:
            assert_array_equal(getattr(again, field), getattr(block, field))
