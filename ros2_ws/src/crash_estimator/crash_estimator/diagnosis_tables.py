"""Terminal tables of a diagnosis: where the model fails, what is missing, and how the error falls."""

from collections.abc import Sequence

from .core.diagnosis.answer import Ranked
from .core.diagnosis.diagnosis import Diagnosis
from .core.diagnosis.misfit import MisfitWindow
from .tables import table

SHOWN = 8


def diagnosis_tables(found: Diagnosis) -> str:
    """All of them, in the order of the work: compare, learn, add, watch."""
    parts = (
        misfit_table(found.misfit, "misfit of the model as given"),
        ranking_table(found.ranking),
        steps_table(found),
        revisions_table(found),
        misfit_table(found.misfit_after, "misfit left") if found.steps else "",
    )
    return "\n\n".join(part for part in parts if part)


def misfit_table(windows: Sequence[MisfitWindow], title: str) -> str:
    """The worst windows in which a residual leaves its band, in order of time."""
    worst = sorted(windows, key=lambda window: -window.rms * (window.end - window.start) ** 0.5)[:SHOWN]
    rows = [
        (
            window.body, window.state, f"{window.start * 1e3:.1f}", f"{window.end * 1e3:.1f}", f"{window.measured:.4g}",
            f"{window.predicted:.4g}", f"{window.rms:.3g}", window.recording,
        )
        for window in windows
        if window in worst
    ]  # fmt: skip
    head = (title, "state", "from ms", "to ms", "measured m/s^2", "predicted m/s^2", "RMS m/s^2", "recording")
    more = f"\n... and {len(windows) - len(worst)} smaller ones" if len(windows) > len(worst) else ""
    return table(head, rows) + more if rows else ""


def ranking_table(ranking: Sequence[Ranked]) -> str:
    """The best candidates of the first round; "?": screened only, its evidence is an estimate."""
    rows = [_row(ranked) for ranked in ranking[:SHOWN]]
    head = ("candidate", "coefficient", "sigma", "unit", "evidence", "explained", "not told from")
    return table(head, rows) if rows else ""


def _row(ranked: Ranked) -> tuple[str, ...]:
    return (
        ranked.name,
        f"{ranked.coefficient:.4g}",
        f"{ranked.std:.2g}" if ranked.fitted else "",
        ranked.unit,
        f"{ranked.evidence:.1f}" + ("" if ranked.fitted else " ?"),
        f"{ranked.explained:.1%}",
        ", ".join(ranked.confounded_with) or "-",
    )


def steps_table(found: Diagnosis) -> str:
    """What was added, in order."""
    rows = [
        (
            f"+ {step.effect} on {step.target}",
            f"{step.coefficient:.4g} +- {step.std:.2g} {step.unit}",
            ", ".join(f"{name} {value:.3g}" for name, value in step.shape.items()) or "-",
            f"{step.evidence:.1f}",
            "; ".join(f"{k} {v['before']:.2f} -> {v['after']:.2f}" for k, v in step.force_explained.items()) or "-",
        )
        for step in found.steps
    ]
    head = ("added", "coefficient", "shape", "evidence", "force explained")
    return table(head, rows) if rows else ""


def revisions_table(found: Diagnosis) -> str:
    """Error against revision of the model: of the fit, over the noise floor, of a free run; and whether it is white."""
    floor = found.residual_rms.noise_floor
    runs = [found.free_run_rms.before, *(step.free_run_rms["after"] for step in found.steps)]
    rows = [
        (
            "as given" if k == 0 else f"+ {found.steps[k - 1].effect} on {found.steps[k - 1].target}",
            f"{model.left.rms:.4g}",
            f"{model.left.rms / floor:.3f}",
            f"{run:.4g}",
            "yes" if model.left.whiteness.white else "no",
        )
        for k, (model, run) in enumerate(zip(found.models, runs))
    ]
    return table(("revision", "residual RMS m/s^2", "over noise floor", "free run RMS m/s^2", "white"), rows)
