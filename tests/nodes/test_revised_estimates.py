"""What an observer gets of a model that was changed: each revision whole, in the order of its samples."""

import numpy as np
import pytest
from crash_msgs.srv import AddEffect
from helpers_estimation import oscillator_recording
from helpers_estimator_node import UNDAMPED, joined
from numpy.testing import assert_array_equal
from rclpy.serialization import deserialize_message

from crash_estimator.core.effects.change import add_effect
from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.model_file import load_model
from crash_estimator.nodes.effect_requests import model_effect, with_effects
from crash_estimator.nodes.revised_estimates import RevisedEstimates
from crash_estimator.nodes.whole_estimates import TOPICS, WholeEstimates
from crash_replay.attending import Attending, Progress


@pytest.fixture
def model(tmp_path) -> str:
    path = tmp_path / "oscillator.yaml"
    path.write_text(UNDAMPED)
    return str(path)


@pytest.fixture(scope="module")
def recording():
    return oscillator_recording(noise=0.5, n=450)


def observe(stage) -> tuple[RevisedEstimates, dict[str, list]]:
    got = {topic: [] for topic in TOPICS}
    take = lambda topic, raw: got[topic].append(deserialize_message(raw, TOPICS[topic]))  # noqa: E731
    revised = RevisedEstimates(stage.node, "estimator", take)
    attending = Attending(stage.node, "viewer", Progress)
    revised.follow(WholeEstimates(stage.node, "estimator", attending, revised.take))
    return revised, got


@pytest.mark.parametrize("changed_at", [250, 500])
def test_a_new_revision_is_handed_out_from_the_first_sample_on(stage, model, recording, changed_at):
    """While samples come, or after the last one; more samples than go into one answer."""
    stage.add_estimator(model=model)
    revised, got = observe(stage)
    stage.send_test(recording)
    stage.send(recording, 0, changed_at, block=10)
    stage.wait_for("estimator", changed_at // 10)
    assert stage.call(AddEffect, "estimator/add_effect", effect="viscous_damping", target="spring").success
    stage.send(recording, changed_at, block=10)
    of = lambda topic, revision: [m for m in got[topic] if m.revision == revision]  # noqa: E731
    whole = lambda topic: sum(len(m.time_ns) for m in of(topic, 1)) == len(recording)  # noqa: E731
    stage.spin_until(lambda: all(map(whole, TOPICS)) and revised.settled, "revision 1 is whole")
    assert revised.why_not == ""

    better = add_effect(load_model(model), "viscous_damping", "spring")
    expected = run(make_estimator(better, recording.test, "constrained_kalman"), recording.samples())
    for topic in TOPICS:
        numbers = [n for m in of(topic, 1) for n in range(m.number, m.number + len(m.time_ns))]
        assert numbers == list(range(len(recording))), f"{topic}: in order, each once"
        assert sum(len(m.time_ns) for m in of(topic, 0)) == changed_at
    found = joined(of("block/parameters", 1), "value")
    assert_array_equal(found, np.array([estimate.parameters for estimate in expected]))


def test_what_cannot_be_had_is_said(stage, model, recording):
    stage.add_estimator(model=model)
    revised, _ = observe(stage)
    stage.send_test(recording)
    stage.send(recording, 0, 100, block=10)
    stage.wait_for("estimator", 10)
    node = stage.estimators[0]
    node.again.begin = lambda follower, revision: None  # it forgets what it was
    assert stage.call(AddEffect, "estimator/add_effect", effect="viscous_damping", target="spring").success
    stage.spin_until(lambda: revised.why_not, "it is said")
    assert revised.settled
    assert revised.why_not.startswith("revision 1: 0 of 100 samples (no estimates of revision 1 on this test")


def test_a_model_is_known_again_by_what_its_estimator_says_of_it(model):
    plain = load_model(model)
    better = add_effect(plain, "coulomb_friction", "spring", coefficient=14.25, shape={"speed": 0.05})
    better = add_effect(better, "viscous_damping", "spring")
    assert with_effects(plain, [model_effect(spec) for spec in better.effects]) == better
    assert with_effects(better, []) == plain
