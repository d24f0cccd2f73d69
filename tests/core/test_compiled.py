"""The compiled recursion against the readable one, at every sample."""

from dataclasses import fields
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from crash_estimator.core.estimate import Estimate
from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.model_file import load_model
from crash_replay.recording import Recording
from crash_replay.synthetic.recordings import SCENARIOS

ARRAYS = [one.name for one in fields(Estimate) if one.type is np.ndarray]
CASES = [
    ("side_dummy_padded", "side_dummy"),
    ("frontal_engine_cab", "frontal_engine_cab"),
    ("frontal_single", "frontal_single"),
    ("impactor_single", "impactor_single"),
]


@cache
def disturbed(name) -> Recording:
    """The first 60 ms."""
    recording, _ = SCENARIOS[name](3)
    keep = recording.time_ns < 60_000_000
    values = recording.values[keep].copy()
    values[700:710, 0] = np.nan  # a dropout on the way
    return Recording(recording.test, recording.time_ns[keep], values)


@cache
def both(name, model, method, **settings):
    """-> the readable form's estimates, the compiled one's, its estimator and the recording."""
    recording = disturbed(name)
    readable, compiled = (
        make_estimator(load_model(model), recording.test, method, compiled=c, **settings) for c in (False, True)
    )
    assert type(readable) is not type(compiled)
    return run(readable, recording.samples()), run(compiled, recording.samples()), compiled, recording


@pytest.mark.parametrize("name, model", CASES)
@pytest.mark.parametrize("method", ["rls", "mrls", "constrained_kalman", "kalman"])
def test_both_forms_agree_at_every_sample(name, model, method):
    # gentle rewinds: a large cr multiplies rounding by itself at each pass, and the two would part by that alone
    settings = {"cr": 1.5} if method == "mrls" else {}
    readable, compiled, _, _ = both(name, model, method, **settings)
    for field in ARRAYS:
        expected = np.array([getattr(e, field) for e in readable], dtype=float)
        found = np.array([getattr(e, field) for e in compiled], dtype=float)
        scale = np.nanmax(np.abs(expected)) or 1.0
        assert_allclose(found, expected, rtol=0.0, atol=1e-8 * scale, err_msg=field)
    assert [e.events for e in readable] == [e.events for e in compiled] or [
        [(event.kind, event.target) for event in e.events] for e in readable
    ] == [[(event.kind, event.target) for event in e.events] for e in compiled]


@pytest.mark.parametrize("method", ["mrls", "constrained_kalman"])
def test_a_block_is_its_samples_one_by_one(method):
    _, single, estimator, recording = both("side_dummy_padded", "side_dummy", method)
    state, rows = estimator.init(), []
    for start in range(0, len(recording), 37):
        part = slice(start, start + 37)
        state, block = estimator.follow(state, recording.time_ns[part], recording.values[part])
        rows.append(block)
    rows = np.concatenate(rows)
    for field in ("parameters", "residual", "force", "std"):
        assert_array_equal(rows[:, estimator.columns[field]], [getattr(e, field) for e in single])
