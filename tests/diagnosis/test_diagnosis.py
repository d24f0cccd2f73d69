"""Which effect is missing: planted effects are found with their size, nothing is found where nothing is missing."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from crash_estimator.core.diagnosis.observation.record import observe
from crash_estimator.core.diagnosis.output_error.normal_equations import may_diverge
from crash_estimator.core.diagnosis.parameterization.magnitudes import measure_magnitudes
from crash_estimator.core.diagnosis.report.diagnosis import Diagnosis, diagnose
from crash_estimator.core.diagnosis.residuals.band_test import band_test
from crash_estimator.core.diagnosis.selection.candidates import candidates
from crash_estimator.core.diagnosis.selection.fitted_model import fit_model
from crash_estimator.core.diagnosis.selection.score_screening import screen
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.sensor_noise import sensor_noise
from crash_estimator.core.structure import EffectSpec, ModelError, Structure
from crash_estimator.model_file import ModelFile
from crash_replay.recording import Recording, RecordingError
from crash_replay.synthetic.hidden.cases import draw_case

SPEEDS = (0.75, 1.1)


@cache
def case(structure: str, *effects: str, seed: int = 3100, noise: float = 1.0, speeds: tuple[float, ...] = SPEEDS):
    """The model without the effects, recordings of the structure with them, and what was hidden."""
    drawn = draw_case(structure, effects, seed)
    recordings = [drawn.record(speed, noise)[0] for speed in speeds]
    return ModelFile.model_validate(dict(drawn.specimen.model)).structure(), recordings, drawn.hidden


@cache
def diagnosed(structure: str, *effects: str, **how) -> Diagnosis:
    model, recordings, _ = case(structure, *effects, **how)
    return diagnose(model, recordings)


PLANTED = [
    ("impactor", "viscous_damping"),
    ("impactor", "cubic_stiffness"),
    ("single", "clearance"),
    ("impactor", "plastic_unloading"),
    ("single", "channel_offset"),
    ("impactor", "unmodelled_body"),
    ("frontal", "quadratic_damping"),
    ("dummy", "load_path"),
]


@pytest.mark.parametrize(("structure", "effect"), PLANTED)
def test_a_planted_effect_is_found_and_the_error_falls_to_the_noise(structure, effect):
    found = diagnosed(structure, effect)
    hidden = case(structure, effect)[2][0]
    assert found.verdict == "effect_missing"
    first = found.ranking[0]
    assert (first.effect, set(first.target.split("-"))) == (effect, set(hidden.target.split("-")))
    assert len(found.steps) == 1
    assert abs(first.coefficient - hidden.coefficient) < 4.0 * first.std, "four sigma: one run of all eight in 2000"
    assert found.residual_rms.after < 1.06 * found.residual_rms.noise_floor < found.residual_rms.before
    assert found.free_run_rms.after < found.free_run_rms.before
    assert found.misfit and len(found.misfit_after) < len(found.misfit)


def test_the_mass_of_an_unmodelled_body_is_beside_those_of_the_model_where_no_force_tells():
    """Halving every mass and force leaves a motion as it is: it would come out lighter by its share of the host's."""
    for seed in (406, 409, 411):
        found = diagnosed("impactor", "unmodelled_body", seed=seed).steps[0]
        (hidden,) = case("impactor", "unmodelled_body", seed=seed)[2]
        assert abs(found.coefficient - hidden.coefficient) < 3.0 * found.std


def test_a_delayed_channel_is_at_rest_until_the_impact_has_reached_it():
    """The door's force jumps at time zero: the first samples say how late the channel is, to a fraction of a step."""
    found = diagnosed("side", "channel_delay", seed=303).steps[0]
    (hidden,) = case("side", "channel_delay", seed=303)[2]
    assert (found.effect, found.target) == ("channel_delay", hidden.target)
    assert abs(found.coefficient - hidden.coefficient) < 3.0 * found.std < 1e-4


def test_along_a_motion_without_bounds_nothing_is_screened():
    model, recordings, _ = case("impactor", "viscous_damping")
    records = [observe(model, recording) for recording in recordings]
    magnitudes = measure_magnitudes(model, records, 12)
    fitted = fit_model(magnitudes, records, ()).fit
    every = candidates(magnitudes, EFFECTS)
    assert screen(magnitudes, records, (), every, None, fitted)
    lost = fitted._replace(trajectories=tuple(t._replace(a=np.full_like(t.a, np.inf)) for t in fitted.trajectories))
    with may_diverge:
        assert screen(magnitudes, records, (), every, None, lost) == []


@pytest.mark.parametrize("structure", ["impactor", "single", "frontal"])
def test_nothing_is_found_where_nothing_is_missing(structure):
    found = diagnosed(structure, seed=3115)
    assert found.verdict == "adequate"
    assert not found.steps and not found.misfit
    assert found.structure == case(structure, seed=3115)[0]


def test_an_effect_outside_the_vocabulary_is_not_given_a_name():
    found = diagnosed("impactor", "rotation", seed=5300)
    assert found.verdict == "unexplained"
    assert "no candidate explains what is left" in found.text


@pytest.mark.parametrize("offered", [(), ("load_path",)])
def test_where_nothing_that_is_offered_can_act_nothing_is_named(offered):
    """Its two bodies are joined already. Without a candidate the search ended in an IndexError."""
    model, recordings, _ = case("impactor", "viscous_damping")
    found = diagnose(model, recordings, effects={name: EFFECTS[name] for name in offered})
    assert found.verdict == "unexplained" and not found.ranking and "no candidate explains what is left" in found.text


def test_where_nothing_unloads_before_the_end_that_is_said():
    """What only unloading shows, a recording that is cut off before cannot."""
    model, recordings, _ = case("impactor")
    cut = [replace(r, time_ns=r.time_ns[: early(r)], values=r.values[: early(r)]) for r in recordings]
    said = "; the recording ends before anything unloads: what would come then is not judged"
    assert diagnose(model, cut).text.endswith(said)
    assert "unloads" not in diagnosed("impactor").text


def early(recording: Recording) -> int:
    """Samples before the deceleration is at its largest."""
    return int(0.95 * np.argmin(recording.values[:, recording.test.index("impactor_ax")]))


def test_with_the_effect_in_it_the_model_is_adequate():
    """The effect comes from a model file: its constants are refined, and nothing else is missing."""
    _, recordings, _ = case("impactor", "viscous_damping")
    again = diagnose(diagnosed("impactor", "viscous_damping").structure, recordings)
    assert again.verdict == "adequate"
    assert_allclose(again.residual_rms.before, diagnosed("impactor", "viscous_damping").residual_rms.after, rtol=1e-3)


def test_two_effects_are_found_one_after_the_other():
    model, recordings, hidden = case("single", "viscous_damping", "channel_offset", seed=4711)
    found = diagnose(model, recordings)
    assert {(step.effect, step.target) for step in found.steps} == {(h.effect, h.target) for h in hidden}
    assert found.verdict == "effect_missing"


def test_what_one_recording_cannot_tell_apart_is_said():
    """A clearance in a linear spring is a stop in one that has no stiffness below it."""
    found = diagnosed("single", "clearance", seed=3105)
    first, second = found.ranking[:2]
    assert (first.effect, second.effect) == ("clearance", "bottoming_out")
    assert not first.identifiable
    assert (first.confounded_with, second.confounded_with) == ((second.name,), (first.name,))
    assert "cannot be told from bottoming_out on car_barrier" in found.text


def test_the_same_recordings_give_the_same_answer():
    model, recordings, _ = case("impactor", "viscous_damping")
    assert diagnose(model, recordings).as_json() == diagnosed("impactor", "viscous_damping").as_json()


def test_dropouts_are_no_effect():
    model, recordings, _ = case("impactor", seed=3115)
    values = recordings[0].values.copy()
    values[200:230, recordings[0].test.index("impactor_ax")] = np.nan
    holed = Recording(recordings[0].test, recordings[0].time_ns, values)
    assert diagnose(model, [holed, recordings[1]]).verdict == "adequate"


def with_effect(structure: Structure, effect: EffectSpec) -> Structure:
    return Structure(structure.name, structure.bodies, structure.elements, (effect,))


def test_a_model_s_mistaken_effect_is_one_clear_line():
    model, recordings, _ = case("impactor", seed=3115)
    with pytest.raises(ModelError, match="effect viscous_damping cannot act on 'face'; it needs an element"):
        diagnose(with_effect(model, EffectSpec("viscous_damping", "face")), recordings)
    with pytest.raises(RecordingError, match="no channel 'extra_ax' .wanted by effect unmodelled_body.; nearest"):
        diagnose(with_effect(model, EffectSpec("unmodelled_body", "extra_ax")), recordings)


def test_no_recording_is_one_clear_line():
    with pytest.raises(ModelError, match="needs at least one recording"):
        diagnose(case("impactor", seed=3115)[0], [])


def test_the_noise_is_that_of_the_sensor_in_spite_of_the_crash():
    rng = np.random.default_rng(1)
    time = np.arange(-100, 1000) * 100_000
    crash = np.where(time > 0, 500.0 * np.sin(2e-8 * np.pi * time), 0.0)
    noise = sensor_noise(crash + rng.normal(0.0, 3.0, len(time)), time, rests=True)
    assert noise.std == pytest.approx(3.0, rel=4.0 / np.sqrt(2.0 * noise.samples))


def test_white_noise_is_white_and_a_small_wave_in_it_is_not():
    rng = np.random.default_rng(5)
    white = rng.normal(size=(1000, 2))
    wave = white + np.outer(0.4 * np.sin(2.0 * np.pi * 40.0 * 1e-4 * np.arange(1000)), [0.0, 1.0])
    samples, period = [np.full(2, 300.0)], [1e-4]
    assert band_test([white], samples, period).white
    found = band_test([wave], samples, period)
    assert not found.white and found.worst.output == 1 and found.worst.low < 40.0 < found.worst.high
