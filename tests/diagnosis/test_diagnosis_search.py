"""What the search for the missing effect relies on: a test of what fits leave, and starts that lead somewhere."""

import numpy as np
import pytest
from scipy.fft import dct, idct

from crash_estimator.benchmarks.second_judge import judge, right
from crash_estimator.core.diagnosis.observation.record import observe
from crash_estimator.core.diagnosis.report.diagnosis import diagnose
from crash_estimator.core.diagnosis.residuals.band_test import Absorbed, band_test, band_test_of_fit
from crash_estimator.core.diagnosis.selection.selection_step import bounded
from crash_estimator.model_file import ModelFile
from crash_replay.second_generator.cases import case_of
from crash_replay.synthetic.hidden.cases import draw_case

SAMPLES, PERIOD = 1000, 1e-4
SLOW = idct(np.eye(SAMPLES)[:8], norm="ortho", axis=1).T
"""Eight parameters, each with a slow cosine as its derivative."""


def left_by_a_fit(seen: np.ndarray) -> tuple[np.ndarray, Absorbed]:
    """Residual of a least-squares fit of the slow cosines, and what is known of it."""
    residual = seen - SLOW @ (SLOW.T @ seen)
    return residual[:, None], Absorbed(residual, SLOW, PERIOD)


def test_noise_that_a_fit_has_absorbed_is_not_taken_for_an_effect():
    """One wrong alarm in a thousand is meant: four in 400 come once in a thousand runs."""
    rng = np.random.default_rng(3)
    known = [np.full(1, np.inf)]
    found = [band_test_of_fit([[left_by_a_fit(rng.normal(size=SAMPLES))[1]]], known) for _ in range(400)]
    assert sum(not one.white for one in found) < 4
    assert abs(np.mean([one.probability for one in found]) - 0.5) < 4.0 / np.sqrt(12.0 * len(found))


def test_a_wave_that_a_fit_has_mostly_absorbed_is_seen_in_what_it_leaves():
    """Below 60 Hz there are 12 cosines, of which the fit takes 8: what it leaves in 4 hides among 12, not among 4."""
    noise = dct(np.random.default_rng(4).normal(size=SAMPLES), norm="ortho")
    noise[:8] += 20.0
    noise[8:12] = np.array([1.0, -1.0, 1.0, -1.0]) * np.sqrt(7.0)
    residual, absorbed = left_by_a_fit(idct(noise, norm="ortho"))
    known = [np.full(1, np.inf)]
    assert band_test([residual], known, [PERIOD]).white
    found = band_test_of_fit([[absorbed]], known)
    assert not found.white and found.worst.low == 0.0


@pytest.mark.parametrize(("seed", "settled"), [(80026, False), (80029, True)])
def test_an_offset_in_one_recording_is_found_though_it_bends_the_motion_that_fits_start_from(seed, settled):
    """Of the first no fit leaves noise: whether it is constant or grows, and how large, hangs on where they end."""
    drawn = draw_case("side", ("channel_offset",), seed)
    structure = ModelFile.model_validate(dict(drawn.specimen.model)).structure()
    found = diagnose(structure, [drawn.record(1.1, 2.0)[0]])
    (step,), (hidden,) = found.steps, drawn.hidden
    assert (step.effect, step.target) == ("channel_offset", hidden.target)
    assert found.complete == settled
    assert not settled or step.coefficient == pytest.approx(hidden.coefficient, abs=3.0 * step.std)


def test_a_motion_without_bounds_leaves_no_more_than_was_measured():
    """Its residual would be taken for noise 20 powers of ten larger than any signal."""
    drawn = draw_case("impactor", ("viscous_damping",), 3100)
    structure = ModelFile.model_validate(dict(drawn.specimen.model)).structure()
    record = observe(structure, drawn.record(1.1, 1.0)[0])
    small, wild = 0.1 * record.measured, 1e25 * record.measured
    assert bounded([small], [record])[0] is small
    assert bounded([wild], [record])[0] is record.measured


def diagnosed(structure: str, effects: tuple[str, ...], seed: int, noise: float):
    """From recordings at two speeds, and what was hidden."""
    drawn = draw_case(structure, effects, seed)
    model = ModelFile.model_validate(dict(drawn.specimen.model)).structure()
    return diagnose(model, [drawn.record(speed, noise)[0] for speed in (0.75, 1.1)]), drawn.hidden


def test_two_effects_are_found_of_which_neither_counts_alone():
    """In noise as large as what one of them leaves, nothing stands out; together they leave the sensors' noise."""
    found, hidden = diagnosed("frontal", ("quadratic_damping", "bottoming_out"), 70301, 1.0)
    assert found.verdict == "effect_missing"
    assert {(step.effect, step.target) for step in found.steps} == {(one.effect, one.target) for one in hidden}


def test_what_is_not_white_in_the_sensors_noise_stays_unexplained_in_a_larger_one():
    """A sensor that turns with its body, mimicked by effects: the larger noise hides what they leave."""
    found, _ = diagnosed("impactor", ("rotation",), 70617, 2.0)
    assert found.verdict == "unexplained" and not found.complete and found.steps


@pytest.mark.parametrize(
    ("effect", "seed", "noise"),
    [
        ("coulomb_friction", 620016, 0.5),  # a light door between stiff elements: only small steps settle it
        ("plastic_unloading", 620058, 0.5),  # screened from the fit without it, it promises 1 to 6 nats
        ("load_path", 8000421, 1.0),  # it pulls: the way in which it carries that screens best does not
        ("plastic_unloading", 620056, 0.5),  # found in the sensors' noise, lost in a larger one
        ("quadratic_damping", 8000521, 0.5),  # a fold within a cell, for which a gain and a mass stood
    ],
)
def test_a_side_impact_that_the_usual_fits_lead_astray_in(effect, seed, noise):
    found, (hidden,) = diagnosed("side", (effect,), seed, noise)
    assert found.verdict == "effect_missing"
    (step,) = found.steps
    assert step.effect == hidden.effect and sorted(step.target.split("-")) == sorted(hidden.target.split("-"))


def test_a_law_whose_fits_all_go_astray_is_found_along_the_motion_of_another_that_leaves_hardly_more_than_noise():
    """A plastic limit: fitted from the measured motion it left 60 times the noise, and a hysteresis was named."""
    assert right(judge(case_of("cab/limit.plastic/1g/clean/25000072")))
