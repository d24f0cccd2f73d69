"""Effective mass as a first stage: the masses replace the model's as soon as they are known, whatever the method."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from crash_estimator.core.fold import run
from crash_estimator.core.mass_first import KNOWN_TO
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.structure import ModelError
from crash_estimator.model_file import load_model
from crash_replay.synthetic.recordings import SCENARIOS


@pytest.fixture(scope="module")
def recording():
    return SCENARIOS["frontal_engine_cab"](3)[0]


def heavier(structure, factor):
    """The model with masses that are wrong."""
    bodies = tuple(replace(body, mass=body.mass * factor) if body.free else body for body in structure.bodies)
    return replace(structure, bodies=bodies)


@pytest.mark.parametrize("method", ["mrls", "constrained_kalman", "afmm"])
def test_wrong_masses_of_the_model_are_replaced(recording, method):
    kept = recording.time_ns < 80_000_000
    recording = replace(recording, time_ns=recording.time_ns[kept], values=recording.values[kept])
    right = load_model("frontal_engine_cab")
    wrong = heavier(right, 1.3)
    results = {}
    for name, structure, first in (("right", right, False), ("wrong", wrong, False), ("found", wrong, True)):
        estimator = make_estimator(structure, recording.test, method, effective_mass=first)
        results[name] = run(estimator, recording.samples())
    late = [k for k, e in enumerate(results["right"]) if e.time_ns > 40_000_000]
    rms = {
        n: np.sqrt(np.mean([estimates[k].innovation ** 2 for k in late], axis=0)) for n, estimates in results.items()
    }
    assert (rms["wrong"] / rms["right"]).max() > 1.5  # the equations contradict each other
    assert_allclose(rms["found"], rms["right"], rtol=0.1)
    assert estimator.description.extra[-2:] == ("cab.mass", "engine.mass")
    assert estimator.description.extra_units[-2:] == ("kg", "kg")
    last = results["found"][-1]
    masses = [body.mass for body in right.bodies if body.free]
    assert_allclose(last.extra[-2:], masses, rtol=0.03)
    assert (np.array(last.extra_std[-2:]) < KNOWN_TO * np.array(masses)).all()
    said = [(e.time_ns, event.text) for e in results["found"] for event in e.events if event.kind == "masses"]
    assert len(said) == 1 and said[0][0] > 0 and "effective masses from here on: cab" in said[0][1]


def test_until_they_are_known_nothing_differs(recording):
    structure = load_model("frontal_engine_cab")
    plain = make_estimator(structure, recording.test, "mrls")
    staged = make_estimator(structure, recording.test, "mrls", effective_mass=True)
    for a, b in zip(run(plain, recording.samples()), run(staged, recording.samples())):
        if any(event.kind == "masses" for event in b.events):
            break
        assert_array_equal(a.parameters, b.parameters)
        assert_array_equal(a.residual, b.residual)
    else:
        pytest.fail("the masses were never known")


def test_a_kept_state_goes_on_as_if_never_left(recording):
    estimator = make_estimator(load_model("frontal_engine_cab"), recording.test, "mrls", effective_mass=True)
    samples = list(recording.samples())
    whole, state = run(estimator, samples), estimator.init()
    for sample in samples[:1000]:
        state, _ = estimator.step(state, sample)
    kept = state
    for sample in samples[1000:1400]:
        state, _ = estimator.step(state, sample)
    state = kept
    for sample, expected in zip(samples[1000:], whole[1000:]):
        state, estimate = estimator.step(state, sample)
        assert_array_equal(estimate.parameters, expected.parameters)


def test_it_is_refused_where_a_force_is_unknown():
    recording = SCENARIOS["side_dummy_unpadded"](3)[0]
    with pytest.raises(ModelError, match="effective mass needs every force and acceleration, but body .* is driven"):
        make_estimator(load_model("side_dummy"), recording.test, "mrls", effective_mass=True)


def test_the_masses_are_said_beside_what_the_method_says(recording):
    structure = load_model("frontal_engine_cab")
    plain = make_estimator(structure, recording.test, "gauss_newton", p=1, q=0).description
    staged = make_estimator(structure, recording.test, "gauss_newton", p=1, q=0, effective_mass=True).description
    assert staged.extra == (*plain.extra, "cab.mass", "engine.mass")
    assert staged.extra_units == (*plain.extra_units, "kg", "kg")
