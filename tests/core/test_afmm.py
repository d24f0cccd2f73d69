"""AFMM: a bank of one is its member, it finds planted jumps and no others, and the rebound of frontal tests."""

import numpy as np
import pytest
from helpers_estimation import oscillator, oscillator_recording
from helpers_paths import DATA
from numpy.testing import assert_allclose, assert_array_equal

from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.structure import Coefficient, ModelError
from crash_estimator.model_file import load_model

NHTSA = DATA / "nhtsa-10146"
BOTH = dict(
    stiffness=Coefficient(1.0e4, True, std=1.0e4, drift=0.0), damping=Coefficient(0.0, True, std=100.0, drift=0.0)
)


def jumps(estimates):
    """(time of the jump in ms, probability, time at which it was seen in ms) of every jump reported."""
    return [
        (float(event.text.split("jumped at ")[1].split(" ms")[0]), event.value, estimate.time_ns * 1e-6)
        for estimate in estimates
        for event in estimate.events
        if event.kind == "jump"
    ]


def test_a_bank_of_one_is_its_member():
    recording = oscillator_recording(noise=5.0)
    alone = run(
        make_estimator(oscillator(**BOTH), recording.test, "constrained_kalman", noise_memory=0, offsets=False),
        recording.samples(),
    )
    bank = make_estimator(
        oscillator(**BOTH), recording.test, "afmm", models=1, interval=0, noise_memory=0, constrained=True
    )
    for a, b in zip(alone, run(bank, recording.samples())):
        assert_allclose(b.parameters, a.parameters, rtol=1e-12)
        # rounding of the weight 1, against products of two standard deviations
        assert_allclose(b.covariance, a.covariance, rtol=1e-12, atol=1e-12 * float(np.prod(a.std)))
        assert_allclose(b.residual, a.residual, rtol=1e-9, atol=1e-9)


def broken_spring(at=0.02, noise=2.0, seed=0):
    """The oscillator's motion with an acceleration whose stiffness goes from 20 to 12 kN/m at a time."""
    recording = oscillator_recording(stiffness=2.0e4, damping=5.0, noise=noise, seed=seed, n=600)
    values = recording.values.copy()
    values[:, 0] += np.where(recording.time >= at, 8.0e3 * values[:, 1] / 10.0, 0.0)
    return type(recording)(recording.test, recording.time_ns, values)


@pytest.mark.parametrize("seed", range(3))
def test_a_planted_jump_is_found_and_no_other(seed):
    recording = broken_spring(seed=seed)
    estimates = run(make_estimator(oscillator(**BOTH), recording.test, "afmm"), recording.samples())
    found = jumps(estimates)
    assert len(found) == 1, found
    when, probability, seen = found[0]
    assert abs(when - 20.0) <= 1.0 and probability > 0.9 and when < seen < 30.0
    assert_allclose(estimates[-1].parameters[0], 1.2e4, rtol=0.03)


@pytest.mark.parametrize("seed", range(5))
def test_constant_parameters_do_not_jump(seed):
    recording = oscillator_recording(noise=5.0, seed=seed, n=600)
    assert not jumps(run(make_estimator(oscillator(**BOTH), recording.test, "afmm"), recording.samples()))


def test_weights_are_published_and_sum_to_one():
    recording = broken_spring()
    estimator = make_estimator(oscillator(**BOTH), recording.test, "afmm", models=4)
    assert estimator.description.extra[:3] == ("model0.weight", "model0.jump", "model1.weight")
    estimates = run(estimator, recording.samples())
    assert np.isnan(estimates[0].extra).all()
    for estimate in estimates[100::50]:
        weights = np.array(estimate.extra[::2])
        assert_allclose(weights.sum(), 1.0)
        assert (np.diff(weights) <= 0.0).all()
    assert abs(estimates[-1].extra[1] - 0.020) <= 0.001  # the likeliest model has assumed the jump


def test_every_channel_counts_only_where_it_is_valid():
    recording = broken_spring()
    values = recording.values.copy()
    values[150:155, 0] = np.nan
    broken = type(recording)(recording.test, recording.time_ns, values)
    estimates = run(make_estimator(oscillator(**BOTH), broken.test, "afmm"), broken.samples())
    assert all(np.isfinite(e.parameters).all() for e in estimates)
    assert len(jumps(estimates)) == 1


@pytest.mark.parametrize("seed", range(2))
def test_it_finds_the_rebound_of_a_simulated_frontal_test(seed):
    synthetic = pytest.importorskip("crash_replay.synthetic.recordings")
    recording, truth = synthetic.SCENARIOS["frontal_single"](seed)
    rebound = recording.time[np.argmax(truth.bodies["car"].displacement)] * 1e3
    estimates = run(make_estimator(load_model("frontal_single"), recording.test, "afmm"), recording.samples())
    nearest = min(jumps(estimates), key=lambda jump: abs(jump[0] - rebound))
    assert abs(nearest[0] - rebound) <= 2.0
    before = [when for when, _, _ in jumps(estimates) if rebound - 30.0 < when < rebound]
    assert not before, "a rebound among many jumps would be no finding"


@pytest.mark.skipif(not NHTSA.exists(), reason="the NHTSA recording is not here")
def test_it_finds_the_rebound_of_nhtsa_10146():
    """73.5 ms: the sign change of the velocity. The engine has stopped at about 38 ms; in between, nothing."""
    from crash_replay.readers import read_source

    recording = read_source(NHTSA)
    estimator = make_estimator(load_model("frontal_single"), recording.test, "afmm")
    estimates = run(estimator, (sample for sample in recording.samples() if sample.time < 0.13))
    late = [when for when, _, _ in jumps(estimates) if when > 45.0]
    assert len(late) == 1 and abs(late[0] - 73.5) <= 5.0, jumps(estimates)


def test_settings_that_make_no_sense_are_refused():
    test = oscillator_recording().test
    with pytest.raises(ModelError, match="probability must be between 0 and 1"):
        make_estimator(oscillator(), test, "afmm", probability=0.0)
    with pytest.raises(ModelError, match="models must be from 1"):
        make_estimator(oscillator(), test, "afmm", models=0)


def test_split_runs_are_whole_runs():
    recording = broken_spring()
    estimator = make_estimator(oscillator(**BOTH), recording.test, "afmm")
    samples = list(recording.samples())
    whole = run(estimator, samples)
    state = estimator.init()
    for sample in samples[:333]:
        state, _ = estimator.step(state, sample)
    for sample, expected in zip(samples[333:], whole[333:]):
        state, estimate = estimator.step(state, sample)
        assert_array_equal(estimate.parameters, expected.parameters)
        assert estimate.events == expected.events
