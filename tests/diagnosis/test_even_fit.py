"""How much a model leaves is told with all outputs alike, whatever noise its effects were ranked in."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from crash_estimator.core.diagnosis.observation.noise_inflation import with_inflated_noise
from crash_estimator.core.diagnosis.observation.record import observe
from crash_estimator.core.diagnosis.parameterization.magnitudes import measure_magnitudes
from crash_estimator.core.diagnosis.residuals.in_band import InBand, in_band
from crash_estimator.core.diagnosis.selection import acceptance, even_fit
from crash_estimator.core.diagnosis.selection.even_fit import evenly_fitted
from crash_estimator.core.diagnosis.selection.fitted_model import fit_model
from crash_estimator.model_file import ModelFile
from crash_replay.synthetic.hidden.cases import draw_case

CFC = 60


SEEDS = 70632, 70604
"""Of tests in which what is left hangs on the output that was followed: of the second on one processor, not on another,
whose last digits lead to another least; of the first there."""


@cache
def observed(seed: int):
    """Of a dummy whose friction the model lacks."""
    case = draw_case("side", ("coulomb_friction",), seed)
    structure = ModelFile.model_validate(dict(case.specimen.model)).structure()
    records = [observe(structure, case.record(1.0, 1.0)[0])]
    magnitudes = measure_magnitudes(structure, records)
    return magnitudes, records, fit_model(magnitudes, records, ())


@cache
def lopsided(followed: int, seed: int = SEEDS[0]):
    """The model in a noise as large as what it leaves, nearly all of it on the outputs that are not followed."""
    magnitudes, records, model = observed(seed)
    problem = model.fit.problem.on(with_inflated_noise(records, model.residuals.residual))
    even = [even_fit._all_alike(record, problem.layout) for record in problem.records]
    quiet = np.full(len(problem.layout.outputs), 1.98)
    quiet[followed] = 0.02
    noise = [record._replace(whitener=record.whitener / np.sqrt(quiet)) for record in even]
    return fit_model(magnitudes, noise, ())


def size(model) -> float:
    return in_band(model.fit, model.residuals, CFC).rms


def spread(sizes) -> float:
    return max(sizes) / min(sizes) - 1.0


def test_what_is_left_does_not_hang_on_which_output_was_followed():
    each = {seed: [size(lopsided(loud, seed)) for loud in (0, 1)] for seed in SEEDS}
    seed, followed = max(each.items(), key=lambda item: spread(item[1]))
    found = [size(evenly_fitted(lopsided(loud, seed), CFC)) for loud in (0, 1)]
    # the curves are held by other hyperparameters, and may end at another least: spreads of 1.3 and 0.002 here
    assert spread(followed) > 1.0
    assert spread(found) < 0.25 * spread(followed)
    assert all(one <= before for one, before in zip(found, followed, strict=True))


def test_the_least_of_all_that_are_known_is_told():
    model = lopsided(0)
    best = evenly_fitted(model, CFC)
    astray = model._replace(fit=model.fit._replace(theta=2.0 * model.fit.theta))
    assert size(evenly_fitted(astray, CFC, best)) <= size(best) * (1.0 + 1e-9)


def test_what_has_other_parameters_is_no_fit_of_the_same_model():
    model = lopsided(0)
    layout = SimpleNamespace(knots=model.fit.layout.knots + 1, names=model.fit.layout.names)
    problem = model.fit.problem._replace(layout=layout)
    other = SimpleNamespace(fit=model.fit._replace(problem=problem, theta=None))
    assert size(evenly_fitted(model, CFC, other)) == pytest.approx(size(evenly_fitted(model, CFC)))


def test_in_the_sensors_own_noise_a_model_is_told_as_it_was_fitted():
    _, _, model = observed(SEEDS[0])
    assert evenly_fitted(model, CFC) is model


def test_only_the_sensors_own_noise_says_that_all_is_noise():
    model = lopsided(0)
    decided = model.residuals.band_test._replace(probability=0.123)
    model = model._replace(residuals=model.residuals._replace(band_test=decided))
    assert evenly_fitted(model, CFC).residuals.band_test == decided


def test_outputs_alike_are_so_in_m_per_s2_and_together_as_loud(monkeypatch):
    """A sensor of 2 m/s^2 that is twice as loud, and one of 300 N on 100 kg, five times; half of both is common."""
    scale, noise = np.array([1.0, 0.01]), np.array([2.0, 300.0])
    correlation = np.array([[1.0, 0.5], [0.5, 1.0]])
    covariance = np.outer([2.0, 5.0], [2.0, 5.0]) * correlation
    monkeypatch.setattr(even_fit, "output_scale", lambda layout: scale)
    record = SimpleNamespace(noise=noise, whitener=np.linalg.inv(np.linalg.cholesky(covariance)))
    record._replace = lambda whitener: whitener
    whitener = even_fit._all_alike(record, None)
    left = np.linalg.inv(whitener) * (noise * scale)  # m/s^2
    assert_allclose(left, np.diag(np.full(2, np.sqrt((4.0**2 + 15.0**2) / 2.0))))


@pytest.mark.parametrize(
    ("in_all", "below", "too_little"), [(0.1, 0.1, True), (0.2, 0.1, False), (0.1, 0.2, False), (0.2, 0.2, False)]
)
def test_what_explains_a_share_of_all_that_is_sampled_or_of_the_band_is_no_little(
    monkeypatch, in_all, below, too_little
):
    """Of a structure that rings nothing explains much of all that is sampled."""

    def model(all_sampled, band):
        return SimpleNamespace(fit=band, residuals=SimpleNamespace(mean_square=1.0 + all_sampled))

    monkeypatch.setattr(acceptance, "in_band", lambda band, residuals, cfc: InBand(band**0.5, 0.0, 0.0, cfc))
    before, after = model(100.0, 100.0), model(100.0 * (1.0 - in_all), 100.0 * (1.0 - below))
    assert acceptance.explains_too_little(before, after, CFC) == too_little
