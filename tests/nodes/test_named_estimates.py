"""Estimates by name: the same numbers as in the blocks, of one sample each, made only for who listens."""

from threading import Thread

import numpy as np
import pytest
from crash_msgs.msg import Equation, Parameter, Parameters, ParametersBlock, Residuals
from helpers_estimation import oscillator_recording
from helpers_estimator_node import MODEL, TIME_ZERO, Stage, joined
from numpy.testing import assert_array_equal
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.task import Future
from std_msgs.msg import Float64

from crash_estimator.core.estimate import ParameterStatus
from crash_estimator.nodes.named_estimates import Entries, topic_of
from crash_replay.qos import EVERY_SAMPLE, STREAM
from crash_replay.recording import Recording
from crash_replay.ros_messages import stamp_ns
from crash_replay.ros_runtime import spin


@pytest.fixture
def model(tmp_path) -> str:
    (tmp_path / "model.yaml").write_text(MODEL)
    return str(tmp_path / "model.yaml")


@pytest.fixture(scope="module")
def recording() -> Recording:
    """A sample of it without a valid value."""
    whole = oscillator_recording(noise=5.0)
    part = Recording(whole.test, whole.time_ns[:120], whole.values[:120].copy())
    part.values[40, 0] = np.nan
    return part


def listen(stage: Stage, name: str) -> dict[str, list]:
    """To the named form of an estimator that is there."""
    heard = {}
    for topic, kind in (("parameters", Parameters), ("residuals", Residuals), ("parameters/spring/stiffness", Float64)):
        heard[topic] = []
        stage.node.create_subscription(kind, f"{name}/{topic}", heard[topic].append, EVERY_SAMPLE)
    return heard


@pytest.mark.parametrize(
    "method, settings",
    [
        ("constrained_kalman", {}),
        ("gauss_newton", {"settings.p": 1, "settings.q": 1, "settings.memory": 0.05}),
    ],
)
@pytest.mark.parametrize("block", [1, 7])
def test_they_are_those_of_the_blocks_to_the_last_bit(stage, model, recording, method, settings, block):
    node = stage.add_estimator("one", model=model, method=method, value_topics=["spring.stiffness"], **settings)
    stage.send_test(recording)
    stage.spin_until(lambda: node.follower, "the test has come")
    named = listen(stage, "one")
    out = [*node.topics.named.streams, *node.topics.named.values.values()]
    stage.spin_until(lambda: all(p.get_subscription_count() for p in out), "somebody listens to the named form")
    stage.send(recording, block=block, run=3)
    stage.spin_until(lambda: all(len(m) == len(recording) for m in named.values()), "all of the named form comes")
    blocks = stage.wait_for("one", -(-len(recording) // block))

    for topic, entries in (("parameters", "parameters"), ("residuals", "equations")):
        messages, table = named[topic], blocks[topic]
        assert [m.number for m in messages] == list(range(len(recording)))
        assert {(m.run, m.model, m.method, m.header.frame_id) for m in messages} == {
            (3, "oscillator", method, "oscillator")
        }
        assert [stamp_ns(m.header.stamp) for m in messages] == (TIME_ZERO + recording.time_ns).tolist()
        assert_array_equal([m.time for m in messages], recording.time_ns * 1e-9)
        fields = [f for f in getattr(messages[0], entries)[0].get_fields_and_field_types() if f not in ("name", "unit")]
        for message in messages:
            assert [e.name for e in getattr(message, entries)] == list(table[0].name)
            assert [e.unit for e in getattr(message, entries)] == list(table[0].unit)
        for field in fields:
            said = np.array([[getattr(entry, field) for entry in getattr(m, entries)] for m in messages])
            assert said.tobytes() == joined(table, field).astype(said.dtype).tobytes(), field
    values = [message.data for message in named["parameters/spring/stiffness"]]
    assert_array_equal(values, joined(blocks["parameters"], "value")[:, 0])


def test_nothing_of_it_is_made_while_nobody_listens(stage, model, recording, monkeypatch):
    made = []
    real = Entries.__call__
    monkeypatch.setattr(Entries, "__call__", lambda self, *args: made.append(1) or real(self, *args))
    node = stage.add_estimator("one", model=model)
    stage.send_test(recording)
    stage.send(recording, stop=50)
    stage.wait_for("one", 50)
    assert not made and not node.topics.named.values
    named = listen(stage, "one")
    stage.spin_until(lambda: node.topics.named.parameters.get_subscription_count(), "somebody listens")
    stage.send(recording, start=50)
    stage.spin_until(lambda: len(named["parameters"]) == len(recording) - 50, "the named form comes")
    assert made


def test_a_block_of_more_samples_than_a_publisher_keeps_comes_whole(stage, model, recording):
    """To one who keeps all, in a thread of its own: the estimator waits for it."""
    node, count, came = stage.add_estimator("one", model=model), STREAM.depth + 500, []
    period = int(recording.time_ns[1] - recording.time_ns[0])
    times = recording.time_ns[0] + period * np.arange(count)
    stage.send_test(long := Recording(recording.test, times, np.resize(recording.values, (count, 3))))
    listener = stage.others.add("listener")
    listener.create_subscription(Parameters, "one/parameters", lambda m: came.append(m.number), EVERY_SAMPLE)
    executor = EventsExecutor(context=listener.context)
    executor.add_node(listener)
    done = Future()
    thread = Thread(target=spin, args=(executor, done))
    thread.start()
    try:
        stage.spin_until(lambda: node.topics.named.parameters.get_subscription_count(), "somebody listens")
        stage.send(long, block=count)
        stage.spin_until(lambda: len(came) == count, "all of it comes")
        assert came == list(range(count))
    finally:
        done.set_result(None)
        executor.wake()
        thread.join()
        executor.shutdown()


def test_enumerations_are_those_of_the_core():
    for kind in (Parameter, ParametersBlock):
        assert {one.name: int(one) for one in ParameterStatus} == {
            one.name: getattr(kind, one.name) for one in ParameterStatus
        }
    assert "status" not in Equation.get_fields_and_field_types()


@pytest.mark.parametrize(
    ("name", "topic"),
    [
        ("rib_spine.stiffness", "rib_spine/stiffness"),
        ("car-engine.damping", "car_engine/damping"),
        ("1st.stiffness", "_1st/stiffness"),
        ("façade.mass", "fa_ade/mass"),
        ("mass", "mass"),
    ],
)
def test_a_topic_is_named_as_ros_wants(name, topic):
    assert topic_of(name) == topic
