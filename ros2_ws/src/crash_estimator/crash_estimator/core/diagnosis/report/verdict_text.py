"""A diagnosis in one readable line."""

from collections.abc import Sequence

from scipy.constants import g as G

from ..residuals.score_test import Drift
from ..selection.fitted_model import Model
from ..selection.thresholds import THRESHOLDS
from .ranking import Ranked, StepReport

MOST_AT_ONCE = 2
"""Effects that are believed together: what takes three of them is more likely one that is not in the vocabulary."""

GOES_ALONG = 0.5
"""Share of what is left that is worth naming what it goes along with."""


def verdict_text(
    verdict: str, steps: Sequence[StepReport], ranking: Sequence[Ranked], first: Model, final: Model, floor: float,
    drift: Drift, as_given: bool,
) -> str:  # fmt: skip
    """first, final: the model as given and with what was added; floor: RMS of the sensors' noise, m/s^2; as_given:
    dampers of compression-only elements may pull as the model file says."""
    said = _said(verdict, steps, ranking, first, final, floor, drift)
    return said if as_given else f"{said}; with contacts that never pull, not even by their dampers"


def _said(verdict, steps, ranking, first: Model, final: Model, floor: float, drift: Drift) -> str:
    names = ", ".join(f"{step.effect} on {step.target}" for step in steps)
    size = f"residual RMS {first.residuals.rms / G:.3g} -> {final.residuals.rms / G:.3g} g, noise floor {floor / G:.3g}"
    if verdict == "adequate":
        left = f"residual RMS {final.residuals.rms / G:.3g} g, noise floor {floor / G:.3g}"
        until = (
            ""
            if _unloads(final)
            else "; the recording ends before anything unloads: what would come then is not judged"
        )
        return f"adequate: nothing significant is missing ({left}){until}"
    if verdict == "effect_missing":
        advice = ""
        rivals = ranking[0].confounded_with if ranking else ()
        if rivals:
            advice = f"; this cannot be told from {', '.join(rivals)}"
            advice += " on one recording: record another speed" if len(first.records) == 1 else " on these recordings"
        small = first.residuals.rms < THRESHOLDS.near_floor**0.5 * floor
        why = f"; small, yet noise would not leave it ({steps[0].evidence:.0f} nats of evidence)" if small else ""
        return f"effect missing: {names}; {size}, now white{why}{advice}"
    along = f"{drift.what} that varies with time, as no candidate does"
    if final.residuals.white and len(steps) > MOST_AT_ONCE:
        why = "one effect of another kind is likelier than so many"
        return f"unexplained: {names} together leave only noise; {size}; {why}"
    if final.residuals.white:
        given = f"with {names} it looks white" if steps else "it looks white"
        return f"unexplained: {given}; {size}; yet what is left goes along with {along}"
    worst = final.residuals.band_test.worst
    layout = final.fit.layout
    where = (
        f"{layout.outputs[worst.output].channel} of {final.records[worst.record].test.id}, "
        f"{worst.low:.0f} to {worst.high:.0f} Hz"
    )
    done = f"{names} {'explains' if len(steps) == 1 else 'explain'} part of it; " if steps else ""
    left = f"no candidate explains what is left, most of it in {where}"
    also = f"; it goes along with {along}" if drift.share > GOES_ALONG and not drift.constant else ""
    return f"unexplained: {done}{size}; {left}{also}"


def _unloads(model: Model) -> bool:
    """Whether any element is seen to come back from its largest crush."""
    links = [link for record in model.residuals.links for link in record]
    return any((link.unloads & ~link.apart).any() for link in links)
