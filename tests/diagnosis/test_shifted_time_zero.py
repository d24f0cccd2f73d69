"""A test whose time zero is stated wrongly, brought to its onset, is diagnosed like the one that was not shifted."""

import pytest
from helpers_paths import BAGS

from crash_estimator.core.diagnosis import diagnose
from crash_estimator.model_file import load_model
from crash_replay.bag import read_bag
from crash_replay.onset import at_onset
from crash_replay.recording import Recording


@pytest.fixture(scope="module")
def model():
    return load_model(BAGS / "hidden_effect.model.yaml")


@pytest.fixture(scope="module")
def recording():
    return read_bag(BAGS / "hidden_effect.mcap")


@pytest.fixture(scope="module")
def as_recorded(model, recording):
    return diagnose(model, [recording])


@pytest.mark.parametrize("ms", [-1.0, 3.0])
def test_with_the_onset_found_the_answer_is_that_of_the_unshifted_test(ms, model, recording, as_recorded):
    late = Recording(recording.test, recording.time_ns - round(ms * 1e6), recording.values)
    found = diagnose(model, [at_onset(late)])
    assert found.verdict == as_recorded.verdict == "effect_missing"
    (step,), (expected,) = found.steps, as_recorded.steps
    assert (step.effect, step.target) == (expected.effect, expected.target)
    assert abs(step.coefficient - expected.coefficient) < expected.std, "the onset may be off by two samples"
