"""A test whose time zero is stated wrongly, brought to its onset, is diagnosed like the one that was not shifted."""

import numpy as np
import pytest
import yaml
from helpers_paths import BAGS

from crash_estimator.benchmarks.effects_judge import drawn
from crash_estimator.benchmarks.effects_plan import case_of
from crash_estimator.benchmarks.second_judge import judge, right
from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.diagnosis.parameterization.nuisances import FARTHEST
from crash_estimator.core.diagnosis.selection import onset_search
from crash_estimator.core.diagnosis.selection.time_zero import RISES, Shift, coasting, touching
from crash_estimator.core.effects import EFFECTS
from crash_estimator.model_file import ModelFile, load_model
from crash_replay.bag import read_bag
from crash_replay.onset import at_onset
from crash_replay.recording import Channel, Recording, Test
from crash_replay.second_generator.cases import case_of as of_second
from crash_replay.second_generator.cases import drawn as drawn_of_second

BEFORE = 0.03
"""s that the second simulator records before the impact."""


@pytest.fixture(scope="module")
def model():
    return load_model(BAGS / "hidden_effect.model.yaml")


@pytest.fixture(scope="module")
def recording():
    return read_bag(BAGS / "hidden_effect.mcap")


@pytest.fixture(scope="module")
def as_recorded(model, recording):
    return diagnose(model, [recording])


def shifted(recording: Recording, ms: float) -> Recording:
    """Its time zero is stated `ms` late."""
    return Recording(recording.test, recording.time_ns - round(ms * 1e6), recording.values)


def test_with_the_onset_found_the_answer_is_that_of_the_unshifted_test(model, recording, as_recorded):
    early, late = (at_onset(shifted(recording, ms)) for ms in (-1.0, 3.0))
    assert np.array_equal(early.time_ns, late.time_ns) and np.array_equal(early.values, late.values, equal_nan=True)
    found = diagnose(model, [late])
    assert found.verdict == as_recorded.verdict == "effect_missing"
    (step,), (expected,) = found.steps, as_recorded.steps
    assert (step.effect, step.target) == (expected.effect, expected.target)
    assert abs(step.coefficient - expected.coefficient) < expected.std, "the onset may be off by two samples"


def test_a_time_zero_stated_late_is_named_before_what_the_model_lacks(model, recording, as_recorded):
    found = diagnose(model, [shifted(recording, 3.0)])
    zero, step = found.steps
    assert (found.verdict, found.complete, zero.effect, zero.target) == (
        "effect_missing", True, "time_zero", recording.test.id,
    )  # fmt: skip
    assert abs(zero.coefficient + 3e-3) < 2.5 * recording.sample_period
    assert zero.residual_rms["after"] < zero.residual_rms["before"]
    (expected,) = as_recorded.steps
    assert (step.effect, step.target) == (expected.effect, expected.target)
    assert abs(step.coefficient - expected.coefficient) < expected.std
    assert found.ranking[0].effect == step.effect, "what can be added to the model"
    assert found.effects_added == (step,) and len(found.models) == 3
    assert [spec.type for spec in found.structure.effects] == [step.effect], "the model itself has no time zero"
    assert "--time-zero S" in found.text


def test_a_time_zero_is_believed_before_a_second_effect_that_makes_up_for_it(model, recording, as_recorded):
    """2 ms late a gain of the driven channel leaves noise as well; the model as given does not see the time zero."""
    found = diagnose(model, [shifted(recording, 2.0)])
    zero, step = found.steps
    (expected,) = as_recorded.steps
    assert (zero.effect, step.effect, step.target) == ("time_zero", expected.effect, expected.target)
    assert abs(zero.coefficient + 2e-3) < 1.5 * recording.sample_period


@pytest.mark.parametrize("structure", ["cab", "sled", "wall"])
def test_the_right_model_says_when_its_bodies_touch(structure):
    case = drawn_of_second(of_second(f"{structure}/nothing/1g/shifted/71900007"))
    true = [1e-9 * recording.time_ns[0] + BEFORE for recording in case.recordings]
    structure = ModelFile.model_validate(yaml.safe_load(case.model_text)).structure()
    search = onset_search._Search(structure, case.recordings, EFFECTS)
    found = [touching(shift, search.in_doubt.as_recorded) for shift in search.begins]
    assert search.in_doubt.noise and not search.in_doubt.added
    off = [(one.seconds - t) / one.std for one, t in zip(found, true, strict=True)]
    assert np.abs(off).max() < 3.0 and max(one.std for one in found) < 2e-4, (found, true)


def test_a_body_that_coasts_has_as_far_to_go_as_it_moves_until_then():
    """A record begins six standard deviations before the impact, or where there is no more before it."""
    channels = (Channel("car_ax", "acceleration", "car", "x"),)
    test = Test("test", channels, initial_velocity={"car": 10.0}, initial_displacement={"car": 0.02, "box": 0.1})
    recording = Recording(test, np.arange(-200, 800) * 100_000, np.zeros((1000, 1)))
    onset = Shift(0, "test", -3e-3, 4e-4, 1e-4)
    impact, std = onset.impact
    assert impact == onset.seconds and std == pytest.approx(np.hypot(4e-4, RISES))
    early = coasting(recording, onset)
    lead = impact + 1e-9 * (early.time_ns[0] - recording.time_ns[0])
    assert lead == pytest.approx(FARTHEST * std, abs=1e-8)
    assert early.test.initial_displacement == pytest.approx({"car": 0.02 - 10.0 * lead, "box": 0.1}, abs=1e-7)
    assert coasting(recording, onset._replace(std=1.0)).time_ns[0] == pytest.approx(0.0, abs=2.0)


def test_what_makes_up_for_a_time_zero_that_is_off_is_not_told_beside_it():
    """The onset is 2 ms late, as the signal begins gently: a gap of 21 mm stood beside it."""
    case = drawn_of_second(of_second("sled/nothing/0.5g/shifted/71900103"))
    found = diagnose(ModelFile.model_validate(yaml.safe_load(case.model_text)).structure(), case.recordings)
    (zero,) = found.steps
    late = max(1e-9 * recording.time_ns[0] + BEFORE for recording in case.recordings)
    assert (found.verdict, found.complete, zero.effect) == ("effect_missing", True, "time_zero")
    assert abs(zero.coefficient - late) < 3e-4


def test_a_fit_gone_astray_makes_no_time_zero_wrong():
    """Slow noise looks like an onset, and the first fit of the right model leaves five times the noise from either."""
    case = drawn_of_second(of_second("cab/nothing/1g/coloured/46000295"))
    found = diagnose(ModelFile.model_validate(yaml.safe_load(case.model_text)).structure(), case.recordings)
    assert found.verdict == "adequate" and "the signals begin -1.6 ms (cab 2)" in found.text, found.text


@pytest.fixture(scope="module")
def padded():
    return read_bag(BAGS / "side_dummy_padded.mcap")


def test_a_right_model_of_a_test_with_a_wrong_time_zero_is_not_adequate(padded):
    found = diagnose(load_model("side_dummy"), [shifted(padded, 5.0)])
    (zero,) = found.steps
    assert (found.verdict, found.complete, zero.effect) == ("effect_missing", True, "time_zero")
    assert abs(zero.coefficient + 5e-3) < 2.5 * padded.sample_period
    assert found.ranking[0].effect == "time_zero" and found.structure.effects == ()


def test_a_time_zero_stated_early_is_told_and_left_to_a_gap_or_a_delay(padded):
    """Driven bodies move later: it makes no difference to them."""
    found = diagnose(load_model("side_dummy"), [shifted(padded, -3.0)])
    assert found.verdict == "adequate" and "the signals begin +3.1 ms (side_dummy_padded)" in found.text, found.text


def test_several_recordings_are_moved_each_by_its_own(padded):
    found = diagnose(load_model("side_dummy"), [shifted(padded, 4.0), shifted(padded, 5.0)])
    (zero,) = found.steps
    assert (found.verdict, found.complete, zero.effect) == ("effect_missing", True, "time_zero")
    assert abs(zero.coefficient + 5e-3) < 2.5 * padded.sample_period


def test_a_gap_that_closes_is_no_wrong_time_zero():
    _, structure, recordings = drawn(case_of("side/clearance/1/1g/10000Hz/0.75,1.1/5000000"))
    found = diagnose(structure, recordings)
    (step,) = found.steps
    assert (found.verdict, step.effect) == ("effect_missing", "clearance") and "the signals begin +" in found.text


LATE_OR_EARLY = {
    "sled/gap.both/1g/shifted/71880000": "an onset that is 2.4 ms late, and by its own account may be right",
    "side/rate.power/0.5g/shifted/71880037": "of one the signals begin before the stated time zero, of the other after",
}
"""Cases of the second simulator, and what they are about."""


@pytest.mark.parametrize("name", LATE_OR_EARLY)
def test_what_is_missing_is_named_whatever_the_stated_time_zeros_are(name):
    assert right(judge(of_second(name))), LATE_OR_EARLY[name]
