"""The report on one recording: the thesis's tables and figures in one Markdown page with its pictures beside it."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from crash_replay.foreign_text import code, code_block, markdown, markdown_cells
from crash_replay.output import written_into
from crash_replay.recording import Recording, RecordingError

from .core.characteristic import characteristics
from .core.diagnosis import diagnose
from .core.effects import EFFECTS
from .core.effects.applied import applied
from .core.effects.effect import Effect
from .core.estimate import Description, ElementState, Estimate, ParameterStatus
from .core.fold import run
from .core.free_run import compare, free_run
from .core.methods import make_estimator
from .core.structure import ModelError, Structure
from .core.validation import LEVELS, Validation, validate
from .diagnosis_doubt import doubt
from .diagnosis_tables import diagnosis_tables
from .figures import Line, Panel, draw, markdown_table, wrapped
from .tables import READABLE, error_table, parameter_table
from .validation_tables import comparison_table, covariance_table, whiteness_table


class Result(NamedTuple):
    """What one method found."""

    description: Description
    estimates: list[Estimate]
    validation: Validation


def write_report(
    recording: Recording,
    structure: Structure,
    methods: Sequence[str],
    folder: Path,
    end: float = np.inf,
    smooth: Callable[[np.ndarray], np.ndarray] = lambda values: values,
    compared: str = "unfiltered",
    settings: Mapping[str, float] = {},
    effects: Mapping[str, Effect] = EFFECTS,
) -> tuple[Path, int]:
    """Write `report.md` and its figures into the folder -> the page, how many figures. The settings go to the methods
    that have them. Names and notes come from a recording and a model, and are written so that a page shows them."""
    if not ((recording.time > 0.0) & (recording.time <= end)).any():
        raise ModelError(f"test {recording.test.id} has no samples between the impact and {end:g} s")
    page = [f"# {markdown(recording.test.title or recording.test.id)}", "", *_test(recording, structure, end), ""]
    page += _missing(recording, structure, end, effects)
    estimated = partial(_estimated, recording, structure, end=end, effects=effects)
    structure = applied(structure, recording.test, effects)
    results = {method: estimated(method, settings=settings) for method in methods}
    page += _tables(results)
    best = methods[-1]
    with written_into(folder) as place:
        page += _figures(structure, results, place)
        page += _free_run(structure, results[best], best, place, end, smooth, compared)
        page += _jumps(estimated("afmm", settings={}), place)
        page += _masses(recording, structure, place, end)
        figures = len(list(place.iterdir()))
        (place / "report.md").write_text(wrapped(page), encoding="utf-8")
    return folder / "report.md", figures


def _estimated(
    recording: Recording, structure: Structure, method: str, end: float, settings: Mapping[str, float],
    effects: Mapping[str, Effect],
) -> Result:  # fmt: skip
    estimator = make_estimator(structure, recording.test, method, effects=effects, **settings)
    estimates = run(estimator, (sample for sample in recording.samples() if sample.time <= end))
    whole = applied(structure, recording.test, effects)  # a load path of its effects is one more element
    return Result(estimator.description, estimates, validate(whole, estimator.description, estimates))


def _test(recording: Recording, structure: Structure, end: float) -> list[str]:
    test = recording.test
    until = min(end, float(recording.time[-1]))
    bodies = [structure.bodies[k].name for k in structure.equations]
    elements = ", ".join(f"{e.name} ({e.between[0]}-{e.between[1]})" for e in structure.elements)
    lines = [
        f"- test {code(test.id)}, {len(recording)} samples every {recording.sample_period * 1e3:g} ms, "
        f"judged up to {until * 1e3:.0f} ms",
        f"- model {code(structure.name)}: equations of {markdown(', '.join(bodies))}; elements {markdown(elements)}",
    ]
    known = [f"{spec.type} on {spec.target}" for spec in structure.effects]
    lines += [f"- effects of the model: {markdown(', '.join(known))}"] if known else []
    lines += [f"- source: {markdown(test.source)}"] if test.source else []
    return lines + [f"- {markdown(note)}" for note in test.notes]


def _missing(recording: Recording, structure: Structure, end: float, effects: Mapping[str, Effect]) -> list[str]:
    """What `diagnose` says; or why it says nothing, which is no reason to say nothing else."""
    until = recording.time <= end
    judged = Recording(recording.test, recording.time_ns[until], recording.values[until])
    try:
        found = diagnose(structure, [judged], effects)
    except (ModelError, RecordingError) as error:
        return ["## What is missing", "", f"Not searched: {markdown(error)}.", ""]
    said = "".join(f"{markdown(text[0].upper() + text[1:])}. " for text in (found.text, doubt(found)) if text)
    said += "Errors here are of the best fit with one curve for each element over the whole record."
    return ["## What is missing", "", said, "", code_block(diagnosis_tables(found)), ""]


def _tables(results: dict[str, Result]) -> list[str]:
    page = ["## Parameters", ""]
    for method, result in results.items():
        page += [f"`{method}`", "", code_block(parameter_table(result.description, result.estimates)), ""]
    page += ["## Mean and variance of error, input and output (thesis tables 5.1 and 5.2)", "", _variances(results), ""]
    page += ["## The error (tables 5.4 and 6.1)", ""]
    for method, result in results.items():
        text = [
            error_table(result.validation.errors),
            covariance_table(result.validation),
            whiteness_table(result.validation),
        ]
        page += [f"`{method}`", "", code_block("\n\n".join(text)), ""]
    page += ["Cross-correlation of the error with the inputs, lag 0 (table 5.4):", "", _cross(results), ""]
    return page


def _variances(results: dict[str, Result]) -> str:
    rows = []
    for k, (name, unit) in enumerate(_equations(results)):
        shown, factor = READABLE[unit]
        errors = [result.validation.errors[k] for result in results.values()]
        rows.append(
            (f"input {name} ({shown})", *(_mean_variance(e.input_mean, e.input_variance, factor) for e in errors))
        )
        rows.append((f"output {name}", *(_mean_variance(e.output_mean, e.output_variance, factor) for e in errors)))
        rows.append((f"error {name}", *(_mean_variance(e.error_mean, e.error_variance, factor) for e in errors)))
    return markdown_table(("mean, variance", *results), markdown_cells(rows))


def _mean_variance(mean: float, variance: float, factor: float) -> str:
    return f"{mean * factor:.3g}, {variance * factor**2:.4g}"


def _cross(results: dict[str, Result]) -> str:
    rows = []
    for method, result in results.items():
        for equation in result.validation.equations:
            values = [f"{name} {c.values[len(c.values) // 2]:+.2f}" for name, c in equation.cross.items()]
            rows.append((f"{equation.equation}, {method}", ", ".join(values)))
    return markdown_table(("error of", "with"), markdown_cells(rows))


def _equations(results: dict[str, Result]) -> list[tuple[str, str]]:
    description = next(iter(results.values())).description
    return list(zip(description.equations, description.equation_units))


def _figures(structure: Structure, results: dict[str, Result], folder: Path) -> list[str]:
    equations = _equations(results)
    outputs, errors, correlations = [], [], []
    for k, (name, unit) in enumerate(equations):
        shown, factor = READABLE[unit]
        measured = _column(next(iter(results.values())).estimates, "measured", k) * factor
        lines = [Line(_time(next(iter(results.values())).estimates), measured, "measured", "#bbbbbb")]
        lines += [
            Line(_time(r.estimates), _column(r.estimates, "predicted", k) * factor, m) for m, r in results.items()
        ]
        outputs.append(Panel(f"{name}: measured and estimated", "time in ms", shown, lines))
        lines = [Line(_time(r.estimates), _column(r.estimates, "residual", k) * factor, m) for m, r in results.items()]
        errors.append(Panel(f"{name}: error", "time in ms", shown, lines))
        correlations += _correlations(k, results)
    draw(folder / "outputs.png", outputs)
    draw(folder / "errors.png", errors)
    draw(folder / "characteristics.png", _characteristics(structure, results))
    page = ["## Estimated outputs (figures 5.5, 5.12, 5.18)", "", "![outputs](outputs.png)", ""]
    page += ["![errors](errors.png)", "", "## Stiffness and force over crush (figures 5.4, 5.11, 6.9, 6.12)", ""]
    page += ["![characteristics](characteristics.png)", ""]
    if correlations:
        draw(folder / "correlations.png", correlations, columns=3, height=2.2)
        page += ["## Correlation of the error (figures 5.13 to 5.15, 5.19 to 5.21)", ""]
        page += ["![correlations](correlations.png)", ""]
    return page


def _correlations(k: int, results: dict[str, Result]) -> list[Panel]:
    """Auto-correlation of one equation's error for all methods, then its cross-correlation with each input."""
    found = {method: r.validation.equations[k] for method, r in results.items() if r.validation.equations[k].auto}
    if not found:
        return []
    first = next(iter(found.values()))
    limits = [(sign * first.auto.limit(level), f"{level:.0%}") for level in LEVELS for sign in (1, -1)]
    lines = [Line(e.auto.lags, e.auto.values, method) for method, e in found.items()]
    panels = [Panel(f"{first.equation}: auto-correlation", "lag, samples", "", lines, limits, y_range=(-1.05, 1.05))]
    for name in first.cross:
        lines = [
            Line(e.cross[name].lags, e.cross[name].values, method) for method, e in found.items() if name in e.cross
        ]
        limits = [(sign * first.cross[name].limit(level), f"{level:.0%}") for level in LEVELS for sign in (1, -1)]
        limits = [(value, label) for value, label in limits if abs(value) <= 1.05]
        panels.append(Panel(f"{first.equation} with {name}", "lag, samples", "", lines, limits, y_range=(-1.05, 1.05)))
    return panels


def _characteristics(structure: Structure, results: dict[str, Result]) -> list[Panel]:
    panels = []
    for k, element in enumerate(structure.elements):
        stiffness, force = [], []
        for method, result in results.items():
            after = [e for e in result.estimates if e.time_ns >= 0 and e.state[k] != ElementState.APART]
            crush = np.array([e.crush[k] for e in after]) * 1e3
            index = result.description.parameters.index(f"{element.name}.stiffness")
            held = (ParameterStatus.KNOWN, ParameterStatus.APART)
            if after and after[-1].status[index] not in held:
                value, std = (np.array([getattr(e, f)[index] for e in after]) * 1e-3 for f in ("parameters", "std"))
                stiffness.append(Line(crush, value, method, spread=std))
            force.append(Line(crush, np.array([e.force[k] for e in after]) * 1e-3, method))
        if stiffness:
            top = max(float(np.nanmax(line.y)) for line in stiffness)
            panels.append(
                Panel(f"{element.name}: stiffness", "crush in mm", "kN/m", stiffness, y_range=(0.0, 1.1 * top or 1.0))
            )
        panels.append(Panel(f"{element.name}: force", "crush in mm", "kN", force))
    return panels


def _free_run(
    structure: Structure, result: Result, method: str, folder: Path, end: float, smooth: Callable, compared: str
) -> list[str]:
    """The best method's characteristics, simulated from the impact on (figures 4.16 to 4.19, 6.13, 6.14)."""
    description, estimates = result.description, result.estimates
    simulated = free_run(structure, description, estimates, end=end)
    panels = []
    for k, (name, unit) in enumerate(zip(description.equations, description.equation_units)):
        shown, factor = READABLE[unit]
        lines = [
            Line(simulated.time * 1e3, smooth(simulated.measured[:, k]) * factor, "measured", "#555555"),
            Line(simulated.time * 1e3, smooth(simulated.predicted[:, k]) * factor, "free run", "#d62728"),
        ]
        panels.append(Panel(f"{name}, {compared}", "time in ms", shown, lines))
    for k, body in enumerate(structure.bodies):
        if body.free and body.acceleration:
            lines = [
                Line(simulated.time * 1e3, simulated.measured_velocity[:, k], "measured", "#555555"),
                Line(simulated.time * 1e3, simulated.velocity[:, k], "free run", "#d62728"),
            ]
            panels.append(Panel(f"{body.name}: velocity", "time in ms", "m/s", lines))
    draw(folder / "free_run.png", panels)
    laws = characteristics(structure, description, estimates)
    slopes = ", ".join(f"{law.element} {law.unloading * 1e-3:.0f} kN/m" for law in laws if law.unloading is not None)
    said = f"Unloading slopes: {markdown(slopes)}." if slopes else "All elements unload as they load."
    rows = comparison_table(compare(structure, description, simulated, smooth))
    return [
        "## Free run (figures 4.16 to 4.19, 6.13, 6.14)", "",
        f"The model with the characteristics from `{method}`, by Runge-Kutta from the initial velocities. {said}", "",
        code_block(rows), "", "![free run](free_run.png)", "",
    ]  # fmt: skip


def _jumps(result: Result, folder: Path) -> list[str]:
    found = [(e.time_ns * 1e-6, event) for e in result.estimates for event in e.events if event.kind == "jump"]
    page = ["## Jumps of the parameters (figure 4.13)", ""]
    if not found:
        return [*page, "None: the parameters change slowly, or the noise hides it.", ""]
    page += [f"- {markdown(event.text)}" for _, event in found]
    marks = [(float(event.text.split("jumped at ")[1].split(" ms")[0]), "") for _, event in found]
    name, unit = result.description.equations[0], result.description.equation_units[0]
    shown, factor = READABLE[unit]
    line = Line(_time(result.estimates), _column(result.estimates, "measured", 0) * factor, colour="#999999")
    draw(folder / "jumps.png", [Panel(f"{name} and the jumps", "time in ms", shown, [line], marks=marks)], columns=1)
    return [*page, "", "![jumps](jumps.png)", ""]


def _masses(recording: Recording, structure: Structure, folder: Path, end: float) -> list[str]:
    """Effective masses, where the model has what they need (figures 4.12, 4.26)."""
    try:
        estimator = make_estimator(structure, recording.test, "effective_mass")
    except ModelError:
        return []
    estimates = run(estimator, (sample for sample in recording.samples() if sample.time <= end))
    names, last = estimator.description.parameters, estimates[-1]
    time, sigma = _time(estimates), partial(_column, estimates, "std")
    lines = [Line(time, _column(estimates, "parameters", k), n, spread=sigma(k)) for k, n in enumerate(names)]
    top = 2.0 * float(last.parameters.sum())
    draw(folder / "masses.png", [Panel("effective masses", "time in ms", "kg", lines, y_range=(0.0, top))], columns=1)
    found = markdown(", ".join(f"{name} {m:.0f} +- {s:.0f} kg" for name, m, s in zip(names, last.parameters, last.std)))
    page = ["## Effective masses (figures 4.12, 4.26)", "", f"{found}; together {last.parameters.sum():.0f} kg.", ""]
    return [*page, "![masses](masses.png)", ""]


def _time(estimates: Sequence[Estimate]) -> np.ndarray:
    return np.array([e.time_ns for e in estimates]) * 1e-6


def _column(estimates: Sequence[Estimate], field: str, k: int) -> np.ndarray:
    return np.array([getattr(e, field)[k] for e in estimates])
