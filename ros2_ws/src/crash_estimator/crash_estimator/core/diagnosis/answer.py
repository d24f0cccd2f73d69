"""The ranking and the steps of a diagnosis, in the terms of its contract."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from crash_replay.conditioning import cfc_filter

from ..effects.base import StaticFactor
from .assess import Left, assess, noise_floor
from .fit import Fit
from .layout import Addition, Layout, Place
from .linearise import balance_of
from .model import Model
from .prior_odds import against_a_mass
from .records import Record
from .rounds import Round
from .temper import CFC, SLOWEST
from .trying import GAIN, Tried

CONFOUNDED = 10.0
"""Nats: evidences closer than this do not tell two candidates apart. That is more than the GAIN by which something is
found: Laplace's approximation and the priors of two different laws leave some nats open between them."""

ACTS = 0.05
"""A barrier's force and inertias are compared while the force is above this share of its peak."""


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
    identifiable: bool
    confounded_with: tuple[str, ...]  # "effect on target"
    shape: dict[str, float] = field(default_factory=dict)  # shape constants found
    fitted: bool = True  # False: screened only; its evidence is an estimate

    @property
    def name(self) -> str:
        return f"{self.effect} on {self.target}"

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

    def as_json(self) -> dict:
        return vars(self)


def stated(place: Place, fitted: Fit) -> tuple[float, float, dict[str, float]]:
    """An effect's coefficient as the literature states it, its standard deviation, and its shape constants.

    A factor's coefficient may be a power of what was fitted, known to a factor: then the standard deviation s of its
    logarithm is what propagates, and c (exp(s) - 1), the upper side, stands for both.
    """
    theta, covariance = fitted.theta, fitted.covariance
    shapes = {name: float(np.exp(theta[p])) for name, p in place.shapes.items()}
    effect, c = place.addition.effect, float(theta[place.coefficient])
    if not isinstance(effect, StaticFactor):
        return c, float(np.sqrt(covariance[place.coefficient, place.coefficient])), shapes
    parameters = [place.coefficient, *place.shapes.values()]

    def value(moved: np.ndarray) -> float:
        return effect.stated(moved[0], **dict(zip(shapes, np.exp(moved[1:]))))

    at = theta[parameters]
    steps = np.maximum(1e-4 * np.abs(at), 1e-12)
    gradient = [(value(at + s * e) - value(at - s * e)) / (2.0 * s) for s, e in zip(steps, np.eye(len(at)))]
    if not np.isfinite(gradient).all():  # next to nothing, stated as one over it
        return value(at), np.inf, shapes
    variance = float(np.array(gradient) @ covariance[np.ix_(parameters, parameters)] @ np.array(gradient))
    with np.errstate(over="ignore"):  # of next to nothing, known to many powers of ten: inf
        factor = np.expm1(np.sqrt(max(variance, 0.0)) / abs(value(at)))
    return value(at), float(abs(value(at)) * factor), shapes


def place_of(layout: Layout, addition: Addition) -> Place:
    return next(place for place in layout.places if place.addition.key == addition.key)


def ranking_of(round_: Round, recordings: int) -> tuple[Ranked, ...]:
    """Candidates that gain anything, and at least the best three."""
    shown = [t for k, t in enumerate(round_.tried) if t.gain > 0.0 or k < 3]
    return tuple(_ranked(tried, round_, shown) for tried in shown)


def _ranked(tried: Tried, round_: Round, shown: list[Tried]) -> Ranked:
    effect, target = tried.addition.key
    fitted = [other for other in shown if other is not tried and other.fit] if tried.fit and tried.gain > GAIN else []
    rivals = tuple(" on ".join(other.addition.key) for other in fitted if _confounded(tried, other))
    before = round_.before.fit.cost
    if tried.fit is None:
        explained = min(max(2.0 * tried.gain / before, 0.0), 1.0) if before > 0.0 else 0.0
        screened = tried.screened
        value, std, shape = screened.coefficient, screened.std, dict(tried.addition.shapes)
        if tried.addition.coefficient is not None:
            value, std = tried.addition.coefficient, np.inf
        elif isinstance(tried.addition.effect, StaticFactor):
            value, std = tried.addition.effect.stated(value, **tried.addition.shapes), np.inf
    else:
        left = assess(tried.fit, round_.before.records)
        explained = float(np.clip(1.0 - left.cost / round_.before.left.cost, 0.0, 1.0))
        value, std, shape = stated(place_of(tried.fit.layout, tried.addition), tried.fit)
    return Ranked(
        effect, target, value, std, tried.addition.effect.unit, float(tried.gain), explained, not rivals, rivals, shape,
        tried.fit is not None,
    )  # fmt: skip


def _confounded(one: Tried, other: Tried) -> bool:
    """Whether the recordings hardly tell two fitted candidates apart: with or without what is held against a mass."""
    gains = [(t.gain, t.gain + against_a_mass(t.fit.layout.structure, t.addition)) for t in (one, other)]
    return any(abs(a - b) < CONFOUNDED for a, b in zip(*gains))


def fit_stated(round_: Round, final: Model) -> Fit:
    """The fit that a step's coefficient is stated from; final: the model with all that was added."""
    # the last model knows best; but where the noise had to be taken larger, it is the round's own fit that is honest
    tempered = final.records[0].mix is not None and round_.before.records[0].mix is not None
    return round_.tried[0].fit if tempered else final.fit


def step_of(round_: Round, before: Model, after: Model, free_run: tuple[float, float], final: Model) -> StepReport:
    """free_run: RMS of the two models' free runs; final: the model with all that was added."""
    tried = round_.tried[0]
    fitted = fit_stated(round_, final)
    value, std, shape = stated(place_of(fitted.layout, tried.addition), fitted)
    floor = noise_floor(before.fit.layout, before.records)
    changed = after.fit if fitted is final.fit else fitted
    return StepReport(
        *tried.addition.key, value, std, tried.addition.effect.unit, float(tried.gain),
        explained=float(np.clip(1.0 - after.left.cost / before.left.cost, 0.0, 1.0)),
        shape=shape,
        residual_rms={"before": before.left.rms, "after": after.left.rms, "noise_floor": floor, "unit": "m/s^2"},
        free_run_rms={"before": free_run[0], "after": free_run[1]},
        force_explained=_force_explained(round_.before.fit, changed, before.records),
    )  # fmt: skip


def _force_explained(before: Fit, after: Fit, records: Sequence[Record]) -> dict[str, dict]:
    """Share of the measured force's variance that the measured accelerations of all masses explain."""
    layout = before.layout
    fixed = [q for q, output in enumerate(layout.outputs) if output.fixed]
    measured = {output.body for output in layout.outputs if not output.fixed}
    if len(fixed) != 1 or measured != {k for k, body in enumerate(layout.structure.bodies) if body.free}:
        return {}
    periods = [record.period for record in records]
    if max(periods) * SLOWEST > 1.0:
        return {}
    before_, after_ = (
        float(np.mean([_balance(fit, record, fixed[0], period) for record, period in zip(records, periods)]))
        for fit in (before, after)
    )
    return {layout.outputs[fixed[0]].channel: {"before": before_, "after": after_}}


def _balance(fitted: Fit, record: Record, row: int, period: float) -> float:
    """1 - var(F + sum M a) / var(F), below CFC 60, while the force acts."""
    force = np.nan_to_num(record.measured[:, row])
    predicted = balance_of(fitted.layout, record, fitted.theta)[record.at]
    force, left = cfc_filter(force, period, CFC), cfc_filter(force - predicted, period, CFC)
    acts = np.abs(force) > ACTS * np.abs(force).max()
    return max(float(1.0 - np.var(left[acts]) / np.var(force[acts])), 0.0)


__all__ = ["Left", "Ranked", "StepReport", "fit_stated", "place_of", "ranking_of", "stated", "step_of"]
