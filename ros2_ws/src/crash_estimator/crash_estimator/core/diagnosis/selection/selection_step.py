"""One step of the selection: all candidates for one more addition, in the sensors' noise or in a larger one."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...effects.effect import Addition, Effect
from ..observation.noise_inflation import with_inflated_noise
from ..observation.record import ObservedRecord
from ..output_error.continuation import FROM_SIMULATION
from ..output_error.gauss_newton import Fit, fit
from ..output_error.normal_equations import may_diverge
from ..parameterization.magnitudes import Magnitudes
from ..residuals.in_band import band_of
from ..residuals.residuals import analyse
from .acceptance import better, coefficient, share_explained, share_removed
from .candidate_fits import CandidateFit, fit_candidates, screen_candidates
from .even_fit import evenly_fitted
from .fitted_model import Model, fit_model
from .search_limit import search_is_over
from .thresholds import THRESHOLDS


class SelectionStep(NamedTuple):
    """The model before it, and all candidates for one more addition, best first."""

    before: Model
    candidates: list[CandidateFit]
    as_recorded: Sequence[CandidateFit] = ()  # in the sensors' noise, where `candidates` are in a larger one
    evenly: Model | None = None  # the model before it as its size is told, where noise was taken larger
    doubted: Sequence[CandidateFit] = ()  # fitted, not believed: rare ones that leave less, or any beside those found

    @property
    def sized(self) -> Model:
        """The model before it, whose error is told and compared."""
        return self.evenly or self.before

    @property
    def best(self) -> CandidateFit | None:
        first = self.candidates[0] if self.candidates else None
        return first if first and first.fit and first.gain > THRESHOLDS.gain else None

    @property
    def leaves_noise(self) -> bool:
        """Only that, without an addition or with the best."""
        return self.before.white or bool(self.best and analyse(self.best.fit).white)

    @property
    def share_removed(self) -> float:
        """Of the mean square above the noise, by the best; 0 where none counts."""
        return share_removed(self.before.residuals, analyse(self.best.fit)) if self.best else 0.0


def in_recorded_noise(magnitudes: Magnitudes, effects: Mapping[str, Effect], model: Model) -> SelectionStep:
    """All candidates against the sensors' noise, with care where one would be believed beside those that were found,
    whatever it leaves."""
    found = fit_candidates(magnitudes, effects, model, thorough=len(model.found) < THRESHOLDS.most_at_once)
    return SelectionStep(model, found, found)


def only_screened(
    magnitudes: Magnitudes, effects: Mapping[str, Effect], model: Model, doubted: Sequence[CandidateFit]
) -> SelectionStep:
    """All candidates, where none would be believed; doubted: those that were fitted nevertheless."""
    found = screen_candidates(magnitudes, effects, model)
    return SelectionStep(model, found, found, doubted=doubted)


def weighed(
    magnitudes: Magnitudes, effects: Mapping[str, Effect], done: SelectionStep, path: Sequence[SelectionStep] = (),
    evenly: Model | None = None, noises: int = THRESHOLDS.few,
) -> SelectionStep:  # fmt: skip
    """The step as it is where only noise is left, else against what the best candidate leaves.

    path: the steps before; evenly: the model before it, as it was fitted with all outputs alike; noises: so many at
    most, each as large as what the best candidate leaves in the one before.
    """
    recorded, model, found = done, done.before, done.candidates
    if done.leaves_noise:
        return done
    fits = {one.addition.key for one in found if one.fit}
    for _ in range(noises):
        larger = done.before is not model
        if search_is_over() or (larger and done.best is None):  # nothing counts: in a larger noise yet, still less does
            break
        noisier = _noise_left_by(done, model.records)
        if larger and abs(_quietness(noisier) - _quietness(done.before.records)) < THRESHOLDS.same_noise:
            break
        gone_on = []
        if fits:
            # what has come up in a larger noise is gone on from in the next, but where a jump would hold it where it is
            new = [o for o in done.candidates[:1] if o.addition.key not in fits and not o.addition.effect.profiled]
            gone_on = [*new, *found]
        done = _in_larger_noise(magnitudes, effects, recorded, noisier, gone_on)
    return done._replace(evenly=evenly_fitted(done.before, band_of_steps([*path, done]), evenly))


def weighed_beside_a_second(
    magnitudes: Magnitudes, effects: Mapping[str, Effect], recorded: SelectionStep, done: SelectionStep
) -> SelectionStep:
    """A first step in which nothing counts, against what the best candidate leaves together with a second one: most of
    what it leaves alone may be the other's, and noise as large as that hides it.

    recorded: the step in the sensors' noise, done: as it was weighed; it stays so where the best one explains less than
    half, where two leave hardly less, or where nothing counts then either.
    """
    if recorded.best is None or done.best or done.leaves_noise or search_is_over():
        return done
    model, band = recorded.before, band_of_steps([recorded])
    larger = as_fitted(model, recorded.best)
    if share_explained(model, larger, band) < THRESHOLDS.half:
        return done
    noise = _noise_left_by(in_recorded_noise(magnitudes, effects, larger), model.records)
    if _quietness(noise) < _quietness(done.before.records) + THRESHOLDS.same_noise:
        return done
    again = _in_larger_noise(magnitudes, effects, recorded, noise, recorded.candidates)
    return again._replace(evenly=evenly_fitted(again.before, band)) if again.best else done


def _in_larger_noise(
    magnitudes: Magnitudes, effects: Mapping[str, Effect], recorded: SelectionStep, noisier: Sequence[ObservedRecord],
    found: Sequence[CandidateFit],
) -> SelectionStep:  # fmt: skip
    """A step in the sensors' noise, done in that of other records; found: candidates that are gone on from, without
    which all are only screened."""
    before = _fitted_from_either(magnitudes, noisier, recorded.before)
    if before.white:  # so it looks; the sensors' own noise decides
        decided = analyse(fit(recorded.before.fit.problem, before.fit.point), sharply=True).band_test
        before = before._replace(residuals=before.residuals._replace(band_test=decided))
    if found:
        candidates = fit_candidates(magnitudes, effects, before, in_other_noise=found)
    else:
        candidates = screen_candidates(magnitudes, effects, before)
    return SelectionStep(before, candidates, recorded.candidates, doubted=recorded.doubted)


def _fitted_from_either(magnitudes: Magnitudes, records: Sequence[ObservedRecord], model: Model) -> Model:
    """The model in another noise, from the measured motion or from where its fit has ended, as either may go astray."""
    found = fit_model(magnitudes, records, model.additions)
    start = found.fit.problem.narrowed(model.fit.layout, model.fit.point)
    other = found.refitted(start, FROM_SIMULATION, hopeless=found.fit.cost)
    return other if better(other, found) else found


def _noise_left_by(step: SelectionStep, records: Sequence[ObservedRecord]) -> tuple[ObservedRecord, ...]:
    """The records with the noise that the candidate leaves whose own makes the recordings likeliest.

    Over the noise, too, the likelihood is largest where the determinant of its covariance over the channels is least.
    In a given noise the candidate that leaves that is always ahead: there may be several for which this holds.
    """
    if not step.best:
        return with_inflated_noise(records, bounded(step.before.residuals.residual, records))
    better = [one for one in step.candidates if one.fit and one.gain > THRESHOLDS.gain]
    noises = [with_inflated_noise(records, bounded(analyse(one.fit).residual, records)) for one in better]
    return max(noises, key=_quietness)


def _quietness(records: Sequence[ObservedRecord]) -> float:
    """Logarithm of the determinant of what makes their noise white."""
    return float(np.linalg.slogdet(records[0].whitener)[1])


@may_diverge
def bounded(residuals: Sequence[np.ndarray], records: Sequence[ObservedRecord]) -> list[np.ndarray]:
    """Residuals, and what was measured itself where a motion without bounds has left more."""
    pairs = zip(residuals, (record.measured for record in records), strict=True)
    return [r if np.nanstd(r) < np.nanstd(measured) else measured for r, measured in pairs]


def added(magnitudes: Magnitudes, model: Model, best: CandidateFit) -> Model:
    """The model with a candidate that was fitted, with all care."""
    return fit_model(magnitudes, model.records, [*model.additions, as_found(best)], best.fit.point)


def as_fitted(model: Model, found: CandidateFit) -> Model:
    """The model with a candidate as that was fitted to weigh it: with less care than `added`."""
    return Model((*model.additions, as_found(found)), found.fit, analyse(found.fit), model.roughness)


def as_found(found: CandidateFit) -> Addition:
    """The addition, starting where its fit has ended."""
    shapes = found.fit.layout.term(found.addition).shapes_at(found.fit.theta)
    return replace(found.addition, coefficient=coefficient(found.addition, found.fit), shapes=shapes)


def models_of(steps: Sequence[SelectionStep], final: Model) -> list[Model]:
    """The models before the steps, and the last one, before which the last step may have ended."""
    models = [step.before for step in steps]
    return models if models[-1] is final else [*models, final]


def sized_models(steps: Sequence[SelectionStep], final: Model) -> tuple[Model, ...]:
    """The models before the steps, and the last one, whose errors are told and compared."""
    models = tuple(step.sized for step in steps)
    return models if steps[-1].before is final else (*models, evenly_fitted(final, band_of_steps(steps)))


def band_of_steps(steps: Sequence[SelectionStep]) -> int | None:
    """The class in which the models' errors are told and compared: that of the model as given."""
    return band_of(steps[0].before)


def fit_stated(step: SelectionStep, final: Model) -> Fit:
    """The fit that a step's coefficient is stated from; final: the model with all that was added.

    The last model knows best; but where the noise had to be taken larger, it is the step's own fit that is honest.
    """
    inflated = final.fit.problem.noise_is_inflated and step.before.fit.problem.noise_is_inflated
    return step.candidates[0].fit if inflated else final.fit
