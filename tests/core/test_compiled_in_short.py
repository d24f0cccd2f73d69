"""The compiled recursion against the readable one on a few samples: quick also where nothing is compiled."""

from types import SimpleNamespace

import numpy as np
import pytest
from helpers_estimation import plain
from numpy.testing import assert_allclose
from test_compiled import ARRAYS

from crash_estimator.core.compiled.follow import _report
from crash_estimator.core.estimate import ElementState, ParameterStatus
from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.model_file import load_model
from crash_replay.recording import Recording
from crash_replay.synthetic.recordings import SCENARIOS

SAMPLES = 70
CASES = [("side_dummy_padded", "side_dummy"), ("frontal_engine_cab", "frontal_engine_cab")]
METHODS = {
    "rls": {},
    "mrls": {"cr": 1.5},  # a large one multiplies rounding by itself, and the two would part by that alone
    "kalman": {},
    "constrained_kalman": {},
}


def sparse(name: str, noise_seed: int = 3) -> Recording:
    """Every tenth sample from shortly before the impact, with a dropout on the way."""
    recording, _ = SCENARIOS[name](noise_seed)
    first = int(np.searchsorted(recording.time_ns, 0)) - 100
    time_ns, values = recording.time_ns[first::10][:SAMPLES], recording.values[first::10][:SAMPLES].copy()
    values[40:43, 0] = np.nan
    return Recording(recording.test, time_ns, values)


def assert_forms_agree(structure, recording, method, **settings):
    readable, compiled = (
        run(make_estimator(structure, recording.test, method, compiled=c, **settings), recording.samples())
        for c in (False, True)
    )
    for field in ARRAYS:
        expected = np.array([getattr(e, field) for e in readable], dtype=float)
        found = np.array([getattr(e, field) for e in compiled], dtype=float)
        if field == "residual_std":  # the root of what is left of two nearly equal variances
            expected, found = expected**2, found**2
        scale = np.nanmax(np.abs(expected)) or 1.0
        assert_allclose(found, expected, rtol=0.0, atol=1e-8 * scale, err_msg=field)
    told = [[(event.kind, event.target) for event in e.events] for e in readable]
    assert told == [[(event.kind, event.target) for event in e.events] for e in compiled]
    return readable


@pytest.mark.parametrize("name, model", CASES)
@pytest.mark.parametrize("method", METHODS)
def test_both_forms_agree_on_a_few_samples(name, model, method):
    assert_forms_agree(load_model(model), sparse(name), method, **METHODS[method])


@pytest.mark.parametrize("method", METHODS)
def test_so_they_do_by_the_preset_of_the_thesis(method):
    assert_forms_agree(
        load_model("frontal_engine_cab"), sparse("frontal_engine_cab"), method, preset="thesis", **METHODS[method]
    )


@pytest.mark.parametrize("unloading", [0.0, 4e5])
@pytest.mark.parametrize("state", ElementState)
def test_only_the_stiffness_of_an_element_on_its_unloading_line_is_held_by_that(state, unloading):
    """Of one element, its stiffness and its damping estimated; what is apart carries nothing at all."""
    two, none, square = np.zeros(2), np.zeros(0), np.eye(2)
    plan = SimpleNamespace(
        element=np.zeros(2, int), slot=np.arange(2), is_stiffness=np.array([1, 0]), unloading=np.array([unloading])
    )
    row = SimpleNamespace(
        state=np.array([float(state)]), parameters=two.copy(), std=two.copy(), status=two.copy(), force=np.zeros(1),
        force_std=np.zeros(1), covariance=square.copy(),
    )  # fmt: skip
    room = SimpleNamespace(
        per_unit=np.ones(2), shift=np.zeros(1), known=none, gradient=np.zeros((0, 2)), before=two, clamped=two
    )
    plain(_report)(plan, SimpleNamespace(estimated=2), SimpleNamespace(theta=np.ones(2), stated=square), row, room)
    usual = ParameterStatus.APART if state == ElementState.APART else ParameterStatus.ESTIMATED
    held = state == ElementState.UNLOADING and unloading > 0.0
    assert list(row.status) == [ParameterStatus.UNLOADING if held else usual, usual]
