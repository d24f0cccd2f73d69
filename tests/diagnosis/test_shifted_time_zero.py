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
from crash_estimator.core.diagnosis.parameterization.layout import FARTHEST
from crash_estimator.core.diagnosis.selection import onset_search
from crash_estimator.core.diagnosis.selection.onset_search import Begun
from crash_estimator.core.diagnosis.selection.time_zero import RISES, Shift, TimeZero, coasting, touching
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


def path(added=0, noise=False, mean_square=1.5, distorts=""):
    """What a selection has found."""
    effect = SimpleNamespace(distorts=distorts)
    return SimpleNamespace(
        added=[SimpleNamespace(effect=effect)] * added, noise=noise, mean_square=mean_square, as_recorded=None,
        final=SimpleNamespace(white=noise), steps=[SimpleNamespace(before=SimpleNamespace(white=noise))],
    )  # fmt: skip


@pytest.mark.parametrize(("one", "other", "is_better"), [
    (path(1, noise=True), path(1, mean_square=1.3), True),
    (path(1, mean_square=1.3), path(2, noise=True), False),
    (path(1, noise=True), path(2, noise=True), True),
    (path(1, noise=True), path(1, noise=True), False),
    (path(1, mean_square=1.3), path(1, mean_square=1.5), True),
    (path(1, mean_square=1.45), path(1, mean_square=1.5), False),
    (path(2, mean_square=1.3), path(1, mean_square=1.5), False),
    (path(1, mean_square=90.0), path(1, mean_square=200.0), False),
    (path(1, mean_square=5.0), path(1, mean_square=200.0), True),
])  # fmt: skip
def test_another_time_zero_must_leave_noise_or_need_less_or_leave_much_less(monkeypatch, one, other, is_better):
    """Of so much more than noise that a real structure may leave it, next to none."""
    monkeypatch.setattr(onset_search, "_left_by", lambda path: path)
    assert onset_search._better(one, other) == is_better


@pytest.mark.parametrize(("found", "seconds", "asked"), [
    (path(0, noise=True), 1e-3, False),
    (path(1, noise=True), 1e-3, False),
    (path(2, noise=True), 1e-3, False),
    (path(2, noise=True, distorts="delay"), 1e-3, True),
    (path(0), 1e-3, True),
    (path(0), 1e-5, False),
    (path(0, mean_square=200.0), 1e-3, False),
])  # fmt: skip
def test_where_bodies_touch_is_asked_where_something_is_left(monkeypatch, found, seconds, asked):
    """A simulated car that lacks nothing was told a time zero and an unloading line, with a larger error."""
    monkeypatch.setattr(onset_search, "_left_by", lambda path: path)
    monkeypatch.setattr(onset_search._Search, "begins", (Shift(0, "test", seconds, 1e-4, 1e-4, differs=False),))
    assert onset_search._Search(None, (), {})._may_begin_elsewhere(found, ()) == asked


@pytest.mark.parametrize(("left_with", "stated", "asked"), [
    ({"given": 1.5}, 30.0, True),
    ({"given": 9.0, "found": 1.5}, 30.0, True),
    ({"given": 9.0, "found": 5.0, "likely": 1.5}, 30.0, True),
    ({"given": 9.0, "found": 5.0, "likely": 3.0, "rare": 1.5}, 30.0, True),
    ({"given": 9.0, "found": 5.0, "likely": 3.0}, 30.0, False),  # less, but no noise
    ({"given": 9.0, "found": 5.0, "likely": 3.0}, 300.0, True),  # next to nothing of so much more
])  # fmt: skip
def test_all_is_searched_with_the_touch_open_only_where_a_likely_fit_is_explained_by_it(
    monkeypatch, left_with, stated, asked
):
    """Such a search took a sixth of the iterations of what nothing explains. In times the cost of noise, of 100."""
    search = onset_search._Search
    monkeypatch.setattr(search, "coasting_records", ())
    monkeypatch.setattr(onset_search, "cost_of_noise", lambda records: 100.0)
    monkeypatch.setattr(onset_search, "measure_magnitudes", lambda *given: None)
    monkeypatch.setattr(onset_search, "make_problem", lambda magnitudes, records, additions: additions)
    monkeypatch.setattr(
        onset_search, "fit", lambda added, hopeless: SimpleNamespace(cost=100.0 * left_with.get(added[-1], 9.0))
    )
    found = SimpleNamespace(
        structure=None, cells=36, as_recorded=SimpleNamespace(cost=100.0 * stated),
        final=SimpleNamespace(additions=("given", "found")),
        steps=[SimpleNamespace(
            before=SimpleNamespace(additions=("given",)),
            as_recorded=[SimpleNamespace(addition="likely", fit=True), SimpleNamespace(addition="screened", fit=None)],
            doubted=[SimpleNamespace(addition="rare", fit=True)],
        )],
    )  # fmt: skip
    assert search(None, (), {})._explained_by_the_touch(found) == asked


@pytest.mark.parametrize(("gain", "seconds", "told"), [(50.0, -4e-3, True), (-19.0, -4e-3, False), (50.0, 5e-4, False)])
def test_a_time_zero_that_is_not_sure_or_from_which_no_less_is_left_is_not_told(monkeypatch, gain, seconds, told):
    """An axis that lacks nothing was told one with -19 nats, a car one by which its error grew fourfold: with less of
    its rest the noise was another one. A door that its own channel drives was told 0.2 +- 0.7 ms."""
    there, moved = Shift(0, "test", seconds, 2e-4, 1e-4), path(1, noise=True)
    search = onset_search._Search
    monkeypatch.setattr(search, "begins", (there,))
    monkeypatch.setattr(search, "in_doubt", path(1, noise=True))
    monkeypatch.setattr(onset_search, "touching", lambda shift, fitted: there)
    monkeypatch.setattr(search, "_rest_until", lambda self, there: True)
    monkeypatch.setattr(search, "_observed", lambda self, shifts: [])
    monkeypatch.setattr(search, "_selected", lambda self, records: moved)
    monkeypatch.setattr(TimeZero, "gain", lambda self, of: gain)
    found = search(None, (), {})._from_the_touch("as stated")
    assert found == (Begun(moved, TimeZero((there,), "as stated")) if told else None)


@pytest.mark.parametrize(("beside", "as_stated", "taken"), [(1, 2, True), (2, 2, False), (2, 3, True)])
def test_a_late_touch_with_two_effects_does_not_stand_before_two_from_the_stated_time_zero(
    monkeypatch, beside, as_stated, taken
):
    """Of seven simulated cars before a gap, with another speed than stated, six were told a time zero, the speed and a
    damper or the like: three, where two leave noise."""
    late, search = Shift(0, "test", 9e-3, 1e-4, 1e-4), onset_search._Search
    touched, found = Begun(path(beside, noise=True), "its time zero"), Begun(path(as_stated, noise=True))
    monkeypatch.setattr(onset_search, "as_given", lambda *given: (None, SimpleNamespace(white=False)))
    monkeypatch.setattr(onset_search, "first_step", lambda *given: SimpleNamespace(leaves_noise=False))
    for name, value in {"begins": (late,), "as_stated": [], "in_doubt": path(1, noise=True)}.items():
        monkeypatch.setattr(search, name, value)
    monkeypatch.setattr(search, "_from_the_touch", lambda self, given: touched)
    monkeypatch.setattr(search, "_stated_or_early", lambda self, zero, elsewhere: found)
    assert search(None, (), {}).begun() is (touched if taken else found)


@pytest.mark.parametrize(("moves", "rests"), [(0.0, True), (3.0, False)])
def test_what_moves_before_an_onset_is_not_left_out(monkeypatch, moves, rests):
    """100 samples from the stated time zero on, to an onset that is said to come 10 ms later; noise of 2 m/s^2."""
    noise = 2.0 * np.random.default_rng(0).standard_normal((100, 1))
    record = SimpleNamespace(
        time=1e-4 * np.arange(100), at=np.arange(100), measured=noise + moves, noise=np.array([2.0]),
        offset_std=np.array([0.1]),
    )  # fmt: skip
    monkeypatch.setattr(onset_search._Search, "as_stated", [record])
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
