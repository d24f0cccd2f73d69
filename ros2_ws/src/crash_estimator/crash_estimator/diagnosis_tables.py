"""Terminal tables of a diagnosis: where the model fails, what is missing, and how the error falls."""

from collections.abc import Sequence

import numpy as np

from crash_replay.gravity import G
from crash_replay.shown_units import readable

from .core.diagnosis import THRESHOLDS, Diagnosis, MisfitWindow, Model, Ranked, StepReport
from .tables import table

SHOWN = 8


def diagnosis_tables(found: Diagnosis) -> str:
    """All of them, in the order of the work: compare, learn, add, watch."""
    adequate = found.verdict == "adequate"
    parts = (
        "" if adequate else misfit_table(found.misfit, "where it fails, as given"),
        ranking_table(found.ranking),
        steps_table(found),
        constants_table(found),
        revisions_table(found),
        misfit_table(found.misfit_after, "where it still fails")
        if found.steps and found.verdict == "unexplained"
        else "",
    )
    return "\n\n".join(part for part in parts if part)


def misfit_table(windows: Sequence[MisfitWindow], title: str) -> str:
    """The worst windows in which a residual leaves its band, in order of time; a force over the free bodies' mass."""
    worst = sorted(windows, key=lambda window: -window.rms * (window.end - window.start) ** 0.5)[:SHOWN]
    rows = [
        (
            window.body, window.state, f"{window.start * 1e3:.1f}", f"{window.end * 1e3:.1f}",
            f"{window.measured / G:.3f}", f"{window.predicted / G:.3f}", f"{window.rms / G:.3g}", window.recording,
        )
        for window in windows
        if window in worst
    ]  # fmt: skip
    head = (title, "state", "from ms", "to ms", "measured g", "predicted g", "RMS g", "recording")
    more = f"\n... and {len(windows) - len(worst)} smaller ones" if len(windows) > len(worst) else ""
    return table(head, rows) + more if rows else ""


def ranking_table(ranking: Sequence[Ranked]) -> str:
    """The best candidates of the first round that gain anything."""
    shown = [ranked for ranked in ranking[:SHOWN] if ranked.evidence > 0.0]
    if not shown or shown[0].evidence < THRESHOLDS.gain:
        best = (
            f": the best, {shown[0].name}, gains {shown[0].evidence:.1f} nats of {THRESHOLDS.gain:.0f}" if shown else ""
        )
        return f"no candidate counts{best}"
    head = ("candidate", "coefficient", "sigma", "unit", "evidence", "explained", "not told from")
    legend = f"evidence in nats, from {THRESHOLDS.gain:.0f} on it counts; explained: share of what the model leaves"
    screened = "; ?: an estimate, not fitted" if not all(ranked.fitted for ranked in shown) else ""
    return f"{table(head, [_row(ranked) for ranked in shown])}\n{legend}{screened}"


def _row(ranked: Ranked) -> tuple[str, ...]:
    return (
        ranked.name + (f" in {ranked.recording}" if ranked.recording else ""),
        f"{ranked.coefficient:.4g}" if np.isfinite(ranked.coefficient) else "none",
        f"{ranked.std:.2g}" if np.isfinite(ranked.std) else "",
        ranked.unit,
        f"{ranked.evidence:.1f}" + ("" if ranked.fitted else " ?"),
        f"{ranked.explained:.1%}",
        ", ".join(ranked.confounded_with) or "-",
    )


def steps_table(found: Diagnosis) -> str:
    """What was added, in order, as the fit of the last model has it; columns that say nothing are left out."""
    columns = {
        "added": [f"+ {step.name}" for step in found.steps],
        "coefficient": [f"{step.coefficient:.4g} +- {step.std:.2g} {step.unit}" for step in found.steps],
        "with": [", ".join(_constants(step)) for step in found.steps],
        "evidence": [f"{step.evidence:.1f}" for step in found.steps],
        "share of force that inertias explain": [
            "; ".join(f"{name} {of['before']:.2f} -> {of['after']:.2f}" for name, of in step.force_explained.items())
            for step in found.steps
        ],
    }
    said = {head: cells for head, cells in columns.items() if any(cells)}
    return table(tuple(said), list(zip(*said.values()))) if found.steps else ""


def _constants(step: StepReport) -> list[str]:
    return [f"{name} {value:.3g} +- {step.shape_std[name]:.2g}" for name, value in step.shape.items()]


def constants_table(found: Diagnosis) -> str:
    """Stiffnesses and dampings that were fitted beside the effects."""
    rows = [
        (f"{one.constant} of {one.element}", f"{one.value:.4g} +- {one.std:.2g} {one.unit}") for one in found.constants
    ]
    return table(("fitted", "with what was added" if found.steps else "as given"), rows) if rows else ""


def revisions_table(found: Diagnosis) -> str:
    """Error against revision of the model: RMS over all outputs and of each, of a free run; and whether it is white."""
    runs = [found.free_run_rms.before, *(step.free_run_rms["after"] for step in found.steps)]
    names = ["as given", *(f"+ {step.name}" for step in found.steps)]
    rows = []
    for name, model, run in zip(names, found.models, runs):
        white = "yes" if model.residuals.band_test.white else "no"
        each = [f"{value:#.3g}" for value in _each_output(model, model.residuals.residual)]
        rows.append((name, f"{model.residuals.rms / G:#.3g}", *each, f"{run / G:#.3g}", white))
    first = found.models[0]
    floor = [f"{value:#.3g}" for value in _each_output(first, [record.noise_of_samples for record in first.records])]
    rows.append(("noise floor", f"{found.residual_rms.noise_floor / G:#.3g}", *floor, "", ""))
    outputs = first.fit.layout.outputs
    heads = [f"{output.channel} {unit}" for output, (unit, _) in zip(outputs, _units(first))]
    return table(("RMS of the error", "all g", *heads, "run freely g", "white"), rows)


def _each_output(model: Model, values: Sequence[np.ndarray]) -> list[float]:
    """RMS of each output over the records, in the unit shown; values: per record (n, q) SI."""
    factor = [factor for _, factor in _units(model)]
    return list(np.sqrt(np.nanmean(np.concatenate(values) ** 2, axis=0)) * factor)


def _units(model: Model) -> list[tuple[str, float]]:
    """Of each output, by the size of what was measured: the unit shown, and the factor to it."""
    measured = np.concatenate([record.measured for record in model.records])
    units = [output.unit for output in model.fit.layout.outputs]
    return [readable(unit, measured[:, k]) for k, unit in enumerate(units)]
