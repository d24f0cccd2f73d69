"""Views of the validation: is what an estimator left over noise, and does its model run by itself (thesis 3.7)."""

from collections.abc import Mapping

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from crash_replay.foreign_text import markdown

from ..core.validation import LEVELS, Correlation, EquationValidation
from ..validation_tables import strongest_input
from .axes import Axis
from .cast import Cast
from .colors import INK, LIMIT_COLORS, MEASURED
from .curves import early_corner
from .drawing import Drawing, Frame, view
from .judged import Judged
from .pen import TIMELINE, Look, Pen, own_path, path
from .summary import row

MOST_EQUATIONS = 4


def write(pen: Pen, cast: Cast, judged: Mapping[str, Judged]) -> None:
    """judged: by estimator."""
    end_ns = round(1e9 * cast.span[1])
    pen.recording.set_time(TIMELINE, duration=np.timedelta64(end_ns, "ns"))
    for name, one in judged.items():
        document = rr.TextDocument(tables(cast, name, one), media_type="text/markdown")
        pen.recording.log(path("validation", "tables", name), document)
    for body, _ in cast.equations:
        own = {n: e for n, j in judged.items() for e in j.validation.equations if e.equation == body and e.auto}
        if not own:
            continue
        autos = {name: equation.auto for name, equation in own.items()}
        correlation_drawing(cast, autos).write(pen, path("validation", body, "auto"), end_ns)
        for u in dict.fromkeys(u for equation in own.values() for u in equation.cross):
            crosses = {name: equation.cross[u] for name, equation in own.items() if u in equation.cross}
            correlation_drawing(cast, crosses).write(pen, path("validation", body, "with", u), end_ns)
    _free_runs(pen, cast, judged)


def tables(cast: Cast, name: str, one: Judged) -> str:
    """Markdown: a column for each equation, on the screen's units."""
    errors, equations = one.validation.errors, one.validation.equations
    shown = [cast.shown(e.unit) for e in errors]
    runs = {c.name: c for c in one.comparisons}
    lines = [f"**{markdown(cast.label(name))}**: what is left over after the impact", ""]
    lines += [
        row("", [f"{e.equation}, {s.unit}" for e, s in zip(errors, shown)]),
        "|---|" + "---:|" * len(errors),
    ]
    for title, mean, variance in (
        ("measured", "input_mean", "input_variance"),
        ("predicted", "output_mean", "output_variance"),
        ("error", "error_mean", "error_variance"),
    ):
        cells = [(s.factor * getattr(e, mean), s.factor**2 * getattr(e, variance)) for e, s in zip(errors, shown)]
        lines.append(row(f"{title}: mean, variance", [f"{m:.3g}, {v:.3g}" for m, v in cells]))
    for level in LEVELS:
        inside = [f"{e.auto.inside(level):.0%}" if e.auto else "–" for e in equations]
        lines.append(row(f"auto-correlation: lags within {level:.0%} limits", inside))
    lines.append(row("uncorrelated (Ljung and Box)", [_uncorrelated(e) for e in equations]))
    lines.append(row("most alike / its 99 % limit", [_alike(e) for e in equations]))
    ratings = [runs[e.equation].rating if e.equation in runs else None for e in errors]
    lines.append(row("simulated freely: ISO/TS 18571", [f"{r.overall:.2f} {r.grade}" if r else "–" for r in ratings]))
    lines += ["", "**covariance of the error** (correlation)", ""]
    lines += [row("", [e.equation for e in errors]), "|---|" + "---:|" * len(errors)]
    factors = np.array([s.factor for s in shown])
    covariance = one.validation.covariance * np.outer(factors, factors)
    for e, values, correlation in zip(errors, covariance, one.validation.correlation):
        lines.append(row(e.equation, [f"{v:.3g} ({r:+.2f})" for v, r in zip(values, correlation)]))
    return "\n".join(lines)


def _uncorrelated(equation: EquationValidation) -> str:
    return next((f"at {level:.0%}" for level in LEVELS if equation.uncorrelated(level)), "no")


def _alike(equation: EquationValidation) -> str:
    name, share = strongest_input(equation.cross)
    return f"{name}: {share:.1f}" if equation.cross else "–"


def correlation_drawing(cast: Cast, found: Mapping[str, Correlation]) -> Drawing:
    """One correlation for all estimators, with the limits that 90, 95, 99 % of noise stay within (of the first)."""
    drawing = Drawing()
    first = next(iter(found.values()))
    lags = int(first.lags[-1])
    frame = Frame((0.2, 0.0, 1.5, 0.9), Axis(float(first.lags[0]), lags, 10.0), Axis(-1.0, 1.0, 0.5))
    frame.draw(drawing, "lag, samples")
    drawing.line([frame.at(float(first.lags[0]), 0.0), frame.at(lags, 0.0)], INK, 0.6)
    for level, color in zip(LEVELS, LIMIT_COLORS, strict=False):
        for limit in (-first.limit(level), first.limit(level)):
            if abs(limit) <= 1.0:
                drawing.line([frame.at(float(first.lags[0]), limit), frame.at(lags, limit)], color, 0.6)
    for name, one in found.items():
        line = [frame.at(float(lag), float(value)) for lag, value in zip(one.lags, np.clip(one.values, -1.0, 1.0))]
        drawing.line(line, cast.color(name), 1.3)
    for at, level, color in zip((0.5, 0.8, 1.1), LEVELS, LIMIT_COLORS, strict=False):
        drawing.text((at, 0.99), f"{level:.0%} limits" if level == 0.90 else f"{level:.0%}", color)
    return drawing


def _free_runs(pen: Pen, cast: Cast, judged: Mapping[str, Judged]) -> None:
    """The model simulated from the impact on, with its forces over crush, against the measurement."""
    measured: set[str] = set()
    for name, one in judged.items():
        if one.simulated is None:
            continue
        time_ns = np.round(one.simulated.time * 1e9).astype(np.int64)
        units = dict(cast.member(name).equations)
        for k, equation in enumerate(one.validation.equations):
            body, factor = equation.equation, cast.shown(units[equation.equation]).factor
            if body not in measured:
                measured.add(body)
                values = factor * one.simulated.measured[:, k]
                pen.curve(path("free_run", body, "measured"), time_ns, values, Look("measured", MEASURED), 3.0)
            values = factor * one.simulated.predicted[:, k]
            pen.curve(own_path("free_run", body, who=name), time_ns, values, Look(of=name), 1.5)


def validation_tab(cast: Cast) -> rrb.Container:
    """Tables at the left; correlations of each equation in the middle; free runs at the right."""
    judged = [m.name for m in cast.members if m.name in cast.judged]
    tables = [rrb.TextDocumentView(origin=path("validation", "tables", name), name=cast.label(name)) for name in judged]
    bodies = cast.equations[:MOST_EQUATIONS]
    least = rrb.Vertical if max(len(cast.inputs_of(body)) for body, _ in bodies) <= 2 else rrb.Grid
    correlations = [
        least(
            view(path("validation", body, "auto"), f"{body}: auto-correlation", 1.6, 1.05, -0.24),
            *(
                view(path("validation", body, "with", u), f"{body} with {u}", 1.6, 1.05, -0.24)
                for u in cast.inputs_of(body)
            ),
            name=body,
        )
        for body, _ in bodies
    ]
    free_runs = [
        rrb.TimeSeriesView(
            origin=path("free_run", body), name=f"{body}: simulated freely, {cast.shown(unit).unit}",
            axis_x=rrb.TimeAxis(link="LinkToGlobal"), plot_legend=rrb.PlotLegend(early_corner(cast, body)),
        )
        for body, unit in bodies
    ]  # fmt: skip
    beside = rrb.Horizontal if least is rrb.Vertical else rrb.Tabs
    parts = rrb.Tabs(*tables), beside(*correlations), rrb.Vertical(*free_runs)
    return rrb.Horizontal(*parts, column_shares=[4, 4, 3], name="Validation")
