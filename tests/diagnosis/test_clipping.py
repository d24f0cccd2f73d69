"""A channel at the end of its range: what it hides is not taken for what happened."""

from dataclasses import replace

import numpy as np
import pytest
from helpers_paths import BAGS

from crash_estimator.core.clipping import clipped
from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.diagnosis.observation.record import observe
from crash_estimator.core.sensor_faults import without_faults
from crash_estimator.core.structure import Body, Coefficient, Element, Structure
from crash_estimator.model_file import load_model
from crash_replay.bag import read_bag
from crash_replay.recording import Channel, Recording, Test


def at_most(recording: Recording, channel: str, share: float) -> Recording:
    """As a sensor records it whose range ends at a share of what happened."""
    k = recording.test.index(channel)
    values = recording.values.copy()
    end = share * np.nanmax(np.abs(values[:, k]))
    values[:, k] = np.clip(values[:, k], -end, end)
    return Recording(recording.test, recording.time_ns, values)


@pytest.fixture(scope="module")
def padded():
    return read_bag(BAGS / "side_dummy_padded.mcap")


def test_what_is_clipped_is_found_and_nothing_else(padded):
    values = padded.column("rib_ay")
    end = 0.6 * np.nanmax(np.abs(values))
    lost = clipped(np.clip(values, -end, end))
    beyond = np.abs(values) >= end
    assert lost[beyond].all() and np.abs(values[lost]).min() > 0.8 * end, "and what is beside it, as close as noise"
    assert not any(clipped(column).any() for column in padded.values.T)


@pytest.mark.parametrize("noise", [0.5, 2.0])
def test_a_level_that_noise_would_not_leave_is_the_end_of_the_range_also_where_it_is_reached_gently(noise):
    """A pulse that rises by less than a step from one sample to the next, noise in steps."""
    step, rng = 2.0, np.random.default_rng(9)
    pulse = 150.0 * np.sin(np.pi * np.clip(np.arange(3000) / 2000, 0.0, 1.0)) + rng.normal(0.0, noise * step, 3000)
    recorded = np.round(np.clip(pulse, None, 130.0) / step) * step
    lost = clipped(recorded)
    assert lost[recorded == 130.0].all() and recorded[lost].min() > 130.0 - 8.0 * noise * step
    assert lost.sum() > 300 and not clipped(np.round(pulse / step) * step).any()


def test_what_is_left_beside_the_end_of_a_range_is_as_high_as_it_was():
    """Near the end those that are not at it are the low ones: in a pulse that leaves it slowly by ten standard
    deviations of their mean."""
    noise, pulse = 20.0, 1500.0 * np.sin(np.pi * np.arange(6000) / 6000)
    low, alone = [], []
    for seed in range(20):
        recorded = np.clip(pulse + np.random.default_rng(seed).normal(0.0, noise, len(pulse)), None, 1480.0)
        lost, at_end = clipped(recorded), recorded == 1480.0
        beside = np.convolve(at_end, np.ones(401), "same") > 0.0
        for found, left in ((low, beside & ~lost), (alone, beside & ~at_end)):
            found.append((recorded - pulse)[left].sum() / (noise * np.sqrt(left.sum())))
    assert abs(np.mean(low)) < 3.0 / np.sqrt(20) < 8.0 < -np.mean(alone), (np.mean(low), np.mean(alone))


def test_holes_numbers_of_coarse_steps_and_what_has_no_noise_are_not_clipped():
    time = np.arange(2000) * 1e-4
    rng = np.random.default_rng(4)
    pulse = 300.0 * np.sin(np.pi * np.clip(time / 0.1, 0.0, 1.0))
    level = np.minimum(pulse, 150.0)
    assert not clipped(level).any(), "without noise a level may be the truth: a force limiter's"
    noisy = pulse + rng.normal(0.0, 1.0, len(time))
    assert not clipped(np.round(noisy / 0.3) * 0.3).any()
    noisy[500:600] = np.nan
    assert not clipped(noisy).any() and not clipped(np.full(50, np.nan)).any() and not clipped(noisy[:3]).any()


def test_the_top_of_a_filtered_pulse_is_no_end_of_a_range():
    """Its numbers have steps: at the top some samples in a row are the same."""
    time = np.arange(2000) * 1e-4
    pulse = 300.0 * np.sin(np.pi * np.clip(time / 0.1, 0.0, 1.0)) ** 2
    noisy = np.round((pulse + 0.2 * np.sin(2.0 * np.pi * 90.0 * time)) / 0.15) * 0.15
    top = noisy == noisy.max()
    assert np.convolve(top, np.ones(4), "valid").max() == 4, "the case that is meant"
    assert not clipped(noisy).any()


def test_a_right_model_of_a_clipped_recording_is_adequate(padded):
    found = diagnose(load_model("side_dummy"), [at_most(padded, "rib_ay", 0.7)])
    assert found.verdict == "adequate" and "rib_ay of side_dummy_padded is clipped" in found.text, found.text


def test_a_missing_effect_is_found_with_a_clipped_channel():
    model = load_model(BAGS / "hidden_effect.model.yaml")
    recording = read_bag(BAGS / "hidden_effect.mcap")
    (expected,) = diagnose(model, [recording]).steps
    found = diagnose(model, [at_most(recording, "rib_ay", 0.7)])
    (step,) = found.steps
    assert (found.verdict, step.effect, step.target) == ("effect_missing", expected.effect, expected.target)
    assert abs(step.coefficient - expected.coefficient) < 2.0 * expected.std


def test_the_recording_that_was_given_stays_as_it_is(padded):
    given = at_most(padded, "rib_ay", 0.7)
    before = given.values.copy()
    diagnose(replace(load_model("side_dummy")), [given])
    np.testing.assert_array_equal(given.values, before)


RIGHT, LEFT, SPRING, SPEED = 1200.0, 300.0, 2e6, 12.0  # kg, kg, N/m, m/s
HEAD_ON = Structure(
    "head-on",
    (Body("right", RIGHT, ("right_ax",)), Body("left", LEFT, ("left_ax",))),
    (Element("fronts", ("right", "left"), Coefficient(1e6, estimated=True, min=0.0), tension=False),),
)


def head_on(end: float) -> Recording:
    """Two cars of which the light one's sensor ends at a share of its peak."""
    time, reduced = np.arange(-400, 1000) * 1e-4, RIGHT * LEFT / (RIGHT + LEFT)
    rate = np.sqrt(SPRING / reduced)
    force = SPRING * SPEED / rate * np.sin(np.clip(rate * time, 0.0, np.pi))
    values = np.column_stack([-force / RIGHT, force / LEFT])
    values += np.random.default_rng(3).normal(0.0, 3.0, values.shape)
    values[:, 1] = np.minimum(values[:, 1], end * force.max() / LEFT)
    channels = tuple(Channel(f"{name}_ax", "acceleration", name, "x") for name in ("right", "left"))
    test = Test("head-on", channels, initial_velocity={"right": SPEED, "left": 0.0})
    return Recording(test, np.rint(time * 1e9).astype(int), values)


def speed_reached(structure: Structure, recording: Recording) -> float:
    """m/s, of the light car, as its channel says once what is clipped has been left out."""
    (mended,), _ = without_faults([recording])
    record = observe(structure, mended)
    return float(record.dt @ record.signals["left_ax"].on_grid)


SPEED_REACHED = 2.0 * SPEED * RIGHT / (RIGHT + LEFT)  # m/s, of an elastic impact


def test_while_a_sensor_is_at_its_end_the_body_moves_as_its_momentum_says():
    """By straight lines the speed is a third too low, and with it every crush is wrong."""
    recording = head_on(0.4)
    assert speed_reached(HEAD_ON, recording) == pytest.approx(SPEED_REACHED, rel=0.01)
    assert diagnose(HEAD_ON, [recording]).verdict == "adequate"


def test_else_as_a_cubic_through_what_is_beside_the_gap():
    """By straight lines a quarter of the half-sine's area is lost."""
    driven = replace(HEAD_ON.bodies[0], driven=True, mass=None)
    of_one = replace(HEAD_ON, bodies=(driven, HEAD_ON.bodies[1]))
    assert speed_reached(of_one, head_on(0.6)) == pytest.approx(SPEED_REACHED, rel=0.06)
