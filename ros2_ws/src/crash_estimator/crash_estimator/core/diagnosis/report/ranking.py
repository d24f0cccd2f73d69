"""The ranking and the steps of a diagnosis, in the terms of its contract."""

from dataclasses import dataclass, field

import numpy as np

from crash_replay.conditioning import cfc_filter

from ..mechanics.masses import balance_of
from ..observation.noise_inflation import CFC, SLOWEST
from ..output_error.gauss_newton import Fit
from ..parameterization.layout import Experiment
from ..parameterization.terms import Term
from ..residuals.residuals import Residuals, analyse, noise_floor
from ..selection.acceptance import odds_against
from ..selection.candidate_fits import CandidateFit
from ..selection.fitted_model import Model
from ..selection.selection_step import SelectionStep
from ..selection.thresholds import THRESHOLDS
from .over_forms import std_over_forms

ACTS = 0.05
"""A barrier's force and inertias are compared while the force is above this share of its peak."""


@dataclass(frozen=True)
class Rms:
    """Root mean square of measured minus predicted over all outputs, m/s^2; None where it is not known."""

    before: float
    after: float
    noise_floor: float | None = None
    unit: str = "m/s^2"


@dataclass(frozen=True)
class Ranked:
    """One candidate."""

    effect: str
    target: str
    coefficient: float
    std: float
    unit: str
    evidence: float  # nats gained over the model without it
    explained: float  # share of the residual's variance that it removes
    identifiable: bool  # nothing else explains as much, and the standard deviation is below the coefficient
    confounded_with: tuple[str, ...]  # "effect on target"
    shape: dict[str, float] = field(default_factory=dict)  # shape constants found
    fitted: bool = True  # False: screened only; its evidence is an estimate
    form: str = ""  # in which the effect is written, of those that it has; "": the usual one
    recording: str = ""  # identifier of the one test that it acts in; "": in all

    @property
    def name(self) -> str:
        return f"{self.effect} on {self.target}"

    @property
    def left(self) -> float:
        """Share of the residual's variance."""
        return 1.0 - self.explained

    def as_json(self) -> dict:
        return vars(self) | {"confounded_with": list(self.confounded_with)}


@dataclass(frozen=True)
class StepReport:
    """One effect added, with the fit before and after it."""

    effect: str
    target: str
    coefficient: float
    std: float
    unit: str
    evidence: float
    explained: float
    shape: dict[str, float]
    residual_rms: dict
    free_run_rms: dict
    force_explained: dict[str, dict]  # per measured force: share explained by the inertias, before and after
    form: str = ""  # as of a `Ranked`
    recording: str = ""  # likewise
    shape_std: dict[str, float] = field(default_factory=dict)  # standard deviations of the shape constants

    @property
    def name(self) -> str:
        form = f" ({self.form})" if self.form else ""
        return f"{self.effect}{form} on {self.target}" + (f" in {self.recording}" if self.recording else "")


def stated(term: Term, fitted: Fit) -> tuple[float, float, dict[str, float]]:
    """An effect's coefficient as the literature states it, its standard deviation, and its shape constants.

    A factor's coefficient may be a power of what was fitted, known to a factor: then the standard deviation s of its
    logarithm is what propagates, and c (exp(s) - 1), the upper side, stands for both.
    """
    theta, covariance = fitted.theta, fitted.covariance
    shapes, effect, c = term.shapes_at(theta), term.addition.effect, float(theta[term.coefficient])
    if not effect.restated:
        return c, float(np.sqrt(covariance[term.coefficient, term.coefficient])), shapes
    parameters = [term.coefficient, *term.shapes.values()]

    def value(moved: np.ndarray) -> float:
        return effect.stated(moved[0], **dict(zip(shapes, np.exp(moved[1:]), strict=True)))

    at = theta[parameters]
    steps = np.maximum(1e-4 * np.abs(at), 1e-12)
    each = zip(steps, np.eye(len(at)), strict=True)
    gradient = [(value(at + s * e) - value(at - s * e)) / (2.0 * s) for s, e in each]
    if not np.isfinite(gradient).all():  # next to nothing, stated as one over it
        return value(at), np.inf, shapes
    with np.errstate(over="ignore", invalid="ignore"):  # of next to nothing, known to many powers of ten: inf
        variance = float(np.array(gradient) @ covariance[np.ix_(parameters, parameters)] @ np.array(gradient))
        factor = np.expm1(np.sqrt(max(variance, 0.0)) / abs(value(at))) if np.isfinite(variance) else np.inf
    return value(at), float(abs(value(at)) * factor), shapes


def ranking_of(step: SelectionStep) -> tuple[Ranked, ...]:
    """Candidates that gain anything, and at least the best three, but for those that are nothing, stated as one over
    it."""
    shown = [one for k, one in enumerate(step.candidates) if one.gain > 0.0 or k < 3]
    every = (_ranked(one, step.before, shown) for one in shown)
    return tuple(one for one in every if np.isfinite(one.coefficient))


def _ranked(one: CandidateFit, before: Model, shown: list[CandidateFit]) -> Ranked:
    addition = one.addition
    effect, target = addition.key
    counts = one.fit and one.gain > THRESHOLDS.gain
    fitted = [other for other in shown if other is not one and other.fit] if counts else []
    no_noise = bool(fitted) and (before.fit.problem.noise_is_inflated or not analyse(one.fit).white)
    rivals = tuple(" on ".join(other.addition.key) for other in fitted if _confounded(one, other, no_noise))
    if one.fit is None:
        cost = before.fit.cost
        explained = min(max(2.0 * one.gain / cost, 0.0), 1.0) if cost > 0.0 else 0.0
        value, std, shape = one.screened.coefficient, one.screened.std, dict(addition.shapes)
        if addition.coefficient is not None:
            value, std = addition.coefficient, np.inf
        elif addition.effect.restated:
            value, std = addition.effect.stated(value, **addition.shapes), np.inf
    else:
        explained = _explained(before.residuals, analyse(one.fit))
        value, std, shape = stated(one.fit.layout.term(addition), one.fit)
    identifiable = not rivals and bool(std <= abs(value))  # whose sigma exceeds it may as well be nothing
    return Ranked(
        effect, target, value, std, addition.effect.unit, float(one.gain), explained, identifiable, rivals, shape,
        one.fit is not None, addition.variant, addition.recording,
    )  # fmt: skip


def _explained(before: Residuals, after: Residuals) -> float:
    """Share of the mean square residual, the noise in it too."""
    return float(np.clip(1.0 - after.mean_square / before.mean_square, 0.0, 1.0))


def _confounded(one: CandidateFit, other: CandidateFit, no_noise: bool) -> bool:
    """Whether the recordings hardly tell two fitted candidates apart: with or without what is held against a mass.

    no_noise: more than noise is left; of two laws of one element that explain nearly as much the evidence says no more
    then of which it is, as it grows with what both explain.
    """
    laws = no_noise and one.addition.effect.acts_on == "element" and one.addition.target == other.addition.target
    errs = 1.0 - THRESHOLDS.nearly_all if laws else THRESHOLDS.form_errs
    margin = max(THRESHOLDS.confounded, errs * max(one.gain, other.gain))
    gains = [(f.gain, f.gain + odds_against(f.addition, f.fit)) for f in (one, other)]
    return any(abs(a - b) < margin for a, b in zip(*gains, strict=True))


def step_of(
    step: SelectionStep, before: Model, after: Model, free_run_rms: tuple[float, float], of_all: Fit
) -> StepReport:
    """free_run_rms: of the two models' free runs; of_all: the fit with all that was added."""
    best = step.candidates[0]
    term = of_all.layout.term(best.addition)
    value, std, shape = stated(term, of_all)
    stds = std_over_forms(term, of_all)
    std = stds[0] if best.addition.effect.remembers else std
    floor = noise_floor(before.fit.layout, before.records)
    changed = best.fit if step.before.fit.problem.noise_is_inflated else after.fit
    return StepReport(
        *best.addition.key, value, std, best.addition.effect.unit, float(best.gain),
        explained=_explained(before.residuals, after.residuals),
        shape=shape,
        residual_rms=vars(Rms(before.residuals.rms, after.residuals.rms, floor)),
        free_run_rms={"before": free_run_rms[0], "after": free_run_rms[1]},
        force_explained=_force_explained(step.before.fit, changed),
        form=best.addition.variant,
        recording=best.addition.recording,
        shape_std={name: value * s for (name, value), s in zip(shape.items(), stds[1:], strict=True)},
    )  # fmt: skip


def _force_explained(before: Fit, after: Fit) -> dict[str, dict]:
    """Share of the measured force's variance that the measured accelerations of all masses explain."""
    layout = before.layout
    fixed = [q for q, output in enumerate(layout.outputs) if output.fixed]
    measured = {output.body for output in layout.outputs if not output.fixed}
    if len(fixed) != 1 or measured != {k for k, body in enumerate(layout.structure.bodies) if body.free}:
        return {}
    if max(record.period for record in before.problem.records) * SLOWEST > 1.0:
        return {}
    shares = [
        float(np.mean([_balance(experiment, fitted.theta, fixed[0]) for experiment in fitted.problem.experiments]))
        for fitted in (before, after)
    ]
    return {layout.outputs[fixed[0]].channel: dict(zip(("before", "after"), shares, strict=True))}


def _balance(experiment: Experiment, theta: np.ndarray, row: int) -> float:
    """1 - var(F + sum M a) / var(F), below CFC 60, while the force acts."""
    record = experiment.record
    force = np.nan_to_num(record.measured[:, row])
    predicted = balance_of(experiment, theta)[record.at]
    force, rest = (cfc_filter(values, record.period, CFC) for values in (force, force - predicted))
    acts = np.abs(force) > ACTS * np.abs(force).max()
    return max(float(1.0 - np.var(rest[acts]) / np.var(force[acts])), 0.0)
