"""A test whose time zero is stated wrongly, brought to its onset, is diagnosed like the one that was not shifted."""

from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from helpers_paths import BAGS

from crash_estimator.benchmarks.effects_judge import drawn
from crash_estimator.benchmarks.effects_plan import case_of
from crash_estimator.benchmarks.second_judge import judge, right
from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.diagnosis.observation.record import observe
from crash_estimator.core.diagnosis.selection import onset_search, time_zero
from crash_estimator.core.diagnosis.selection.onset_search import Begun
from crash_estimator.core.diagnosis.selection.time_zero import Shift, moved_by, onsets, sharpened
from crash_estimator.model_file import ModelFile, load_model
from crash_replay.bag import read_bag
from crash_replay.onset import at_onset
from crash_replay.recording import Recording
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


@pytest.mark.parametrize("structure", ["cab", "sled", "side", "wall"])
def test_the_right_model_says_when_its_motion_began(structure):
    case = drawn_of_second(of_second(f"{structure}/nothing/1g/shifted/71900007"))
    true = [1e-9 * recording.time_ns[0] + BEFORE for recording in case.recordings]
    structure = ModelFile.model_validate(yaml.safe_load(case.model_text)).structure()

    def observed(shifts):
        return [observe(structure, one) for one in moved_by(shifts, case.recordings)]

    begins = onsets(case.recordings, [0.0] * len(case.recordings))
    found = sharpened(begins, [one._replace(seconds=0.0) for one in begins], structure, [[]], observed, np.inf)
    off = [(one.seconds - t) / one.std for one, t in zip(found.shifts, true)]
    assert np.abs(off).max() < 3.0 and max(one.std for one in found.shifts) < 2e-4, (found.shifts, true)
    assert found.gain > 100.0, "nats, over the stated time zeros"


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


def begun(shifts):
    """A record that begins where the first of the shifts says."""
    return [SimpleNamespace(bins=100, measured=np.zeros((1, 1)), at=shifts[0].seconds)]


def left(rms):
    return SimpleNamespace(rms=rms, mean_square=rms**2)


def leaving(monkeypatch, rms):
    """Any model leaves rms(s), m/s^2, of a record that begins there, however it is fitted."""
    monkeypatch.setattr(time_zero, "measure_magnitudes", lambda *given: None)
    for fitted in ("_fitted", "_with_care"):
        monkeypatch.setattr(time_zero, fitted, lambda magnitudes, records, additions: left(rms(records[0].at)))


def test_of_several_laws_the_one_that_leaves_least_says_when_the_motion_began(monkeypatch):
    """From 0.3 ms after the onset on the second one leaves least, and less than the first one does from anywhere."""
    onset = Shift(0, "test", 1e-3, 4e-4, 1e-4)
    monkeypatch.setattr(time_zero, "measure_magnitudes", lambda *given: None)

    def leaves(magnitudes, records, additions):
        off = records[0].at - (1.3e-3 if additions == ["second"] else 0.8e-3)
        return left((1.0 if additions == ["second"] else 1.5) + (off / 1e-3) ** 2)

    for fitted in ("_fitted", "_with_care"):
        monkeypatch.setattr(time_zero, fitted, leaves)
    found = sharpened([onset], [onset], None, [["first"], ["second"], []], begun, 2.0)
    assert found.shifts[0].seconds == pytest.approx(1.3e-3, abs=1.01e-4)
    assert found.gain > 0.0


@pytest.mark.parametrize(("found_leaves", "sharper_gains"), [(2.0, True), (0.5, False)])
def test_a_sharper_time_zero_must_leave_less_than_all_that_was_found_without_it(
    monkeypatch, found_leaves, sharper_gains
):
    """With the first effect the model leaves 1 m/s^2 from where the recording is taken, and 0.9 from its onset."""
    onset = Shift(0, "test", 1e-3, 1e-4, 1e-4)
    leaving(monkeypatch, lambda seconds: 0.9 if seconds == onset.seconds else 1.0)
    stated = onset._replace(seconds=onset.seconds + 5e-5)
    found = sharpened([onset], [stated], None, [[]], begun, found_leaves)
    assert (found.gain > 0.0) == (found.of_residuals > 0.0) == sharper_gains


def test_what_the_onsets_alone_speak_for_is_no_gain_of_what_is_left(monkeypatch):
    """The model leaves more from the onset on, which is known to 0.1 ms, than from the stated time zero."""
    onset = Shift(0, "test", 3e-3, 1e-4, 1e-4)
    leaving(monkeypatch, lambda seconds: 1.0 + 0.5e3 * seconds)
    found = sharpened([onset], [onset._replace(seconds=0.0)], None, [[]], begun, 1.0)
    assert found.gain > 0.0 > found.of_residuals


@pytest.mark.parametrize(("coarsely", "closer"), [(1.5, True), (4.0, False)])
def test_where_much_more_than_noise_is_left_about_an_onset_no_closer_look_is_taken(monkeypatch, coarsely, closer):
    """m/s^2, in a noise of 1: in 0.8 ms steps about an onset that may be 1 ms off."""
    onset = Shift(0, "test", 3e-3, 1e-3, 1e-4)
    leaving(monkeypatch, lambda seconds: coarsely)
    monkeypatch.setattr(time_zero, "_with_care", lambda *given: left(0.9))
    found = sharpened([onset], [onset], None, [[]], begun, 5.0)
    assert (found is not None) == closer


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


def test_no_time_zero_is_sought_where_the_model_as_stated_leaves_noise(monkeypatch):
    """A simulated car that lacks nothing was told a time zero and an unloading line, with a larger error."""
    nothing = SimpleNamespace(final=SimpleNamespace(white=True), added=(), noise=True)
    elsewhere = (Shift(0, "test", 1e-3, 1e-4, 1e-4),)
    monkeypatch.setattr(onset_search, "onsets", lambda recordings, early: elsewhere)
    assert onset_search._Search(None, (), {}).from_sharper_onsets(Begun(nothing, None, elsewhere)) is None


@pytest.mark.parametrize("noise", [True, False])
@pytest.mark.parametrize(("gain", "told"), [(50.0, True), (-19.0, False)])
def test_a_time_zero_from_which_no_less_is_left_is_not_told(monkeypatch, gain, told, noise):
    """An axis that lacks nothing was told one with -19 nats, a car one by which its error grew fourfold: with less of
    its rest the noise was another one."""
    elsewhere = (Shift(0, "test", -4e-3, 1e-4, 1e-4),)
    before = SimpleNamespace(white=False)
    stated = SimpleNamespace(final=before, added=(), noise=False, steps=[SimpleNamespace(before=before)])
    moved = SimpleNamespace(final=SimpleNamespace(white=noise), added=(), noise=noise)
    zero = SimpleNamespace(gain=lambda of: gain, shifts=elsewhere)
    search = onset_search._Search
    monkeypatch.setattr(onset_search, "onsets", lambda recordings, early: elsewhere)
    monkeypatch.setattr(onset_search, "_leaves_far_more", lambda path: False)
    monkeypatch.setattr(search, "_observed", lambda self: [])
    monkeypatch.setattr(search, "_at_onsets", lambda self, *given: elsewhere)
    monkeypatch.setattr(search, "_sharper", lambda self, *given: ())
    monkeypatch.setattr(search, "_sharper_by_other_laws", lambda self, *given: ())
    monkeypatch.setattr(search, "_rest_until", lambda self, there: True)
    monkeypatch.setattr(search, "_begun", lambda self, *given: Begun(moved, zero))
    monkeypatch.setattr(onset_search, "_left_by", lambda path: SimpleNamespace(mean_square=2.0 - (path is moved)))
    monkeypatch.setattr(onset_search, "_much_better", lambda path, tried: tried[-1] if tried else None)
    found = search(None, (), {}).from_sharper_onsets(Begun(stated, None, elsewhere))
    assert found == (Begun(moved, zero) if told else None)


@pytest.mark.parametrize(("moves", "rests"), [(0.0, True), (3.0, False)])
def test_what_moves_before_an_onset_is_not_left_out(monkeypatch, moves, rests):
    """100 samples from the stated time zero on, to an onset that is said to come 10 ms later; noise of 2 m/s^2."""
    noise = 2.0 * np.random.default_rng(0).standard_normal((100, 1))
    record = SimpleNamespace(
        time=1e-4 * np.arange(100), at=np.arange(100), measured=noise + moves, noise=np.array([2.0]),
        offset_std=np.array([0.1]),
    )  # fmt: skip
    monkeypatch.setattr(onset_search._Search, "_observed", lambda self: [record])
    later = [Shift(0, "test", 1e-2, 1e-4, 1e-4)]
    assert onset_search._Search(None, (), {})._rest_until(later) == rests
    assert onset_search._Search(None, (), {})._rest_until([later[0]._replace(seconds=-1e-3)])


LATE_OR_EARLY = {
    "sled/gap.both/1g/shifted/71880000": "an onset that is 2.4 ms late, and by its own account may be right",
    "side/rate.power/0.5g/shifted/71880037": "of one the signals begin before the stated time zero, of the other after",
}
"""Cases of the second simulator, and what they are about."""


@pytest.mark.parametrize("name", LATE_OR_EARLY)
def test_what_is_missing_is_named_whatever_the_stated_time_zeros_are(name):
    assert right(judge(of_second(name))), LATE_OR_EARLY[name]
