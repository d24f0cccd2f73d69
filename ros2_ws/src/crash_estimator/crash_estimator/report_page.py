"""The report on one recording: what the model lacks, the thesis's tables and figures, on one page."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from crash_replay.output import written_into
from crash_replay.recording import Recording, RecordingError
from crash_replay.shown_units import readable

from .core.characteristic import characteristics
from .core.compare_free_run import compare
from .core.derived_motion import with_accelerations
from .core.diagnosis import UNEXPLAINED, Diagnosis, diagnose
from .core.effects import EFFECTS
from .core.effects.applied import applied
from .core.effects.effect import Effect
from .core.fold import run
from .core.free_run import free_run
from .core.methods import make_estimator
from .core.structure import ModelError, Structure
from .core.validation import validate
from .diagnosis_doubt import doubt
from .diagnosis_tables import diagnosis_tables
from .figures import Line, Panel
from .first_sentence import first_sentence
from .page_blocks import Block, Bullets, Figure, Heading, Lines, Page, Paragraph, Table
from .page_html import html_page
from .page_markdown import write_markdown_page
from .report_figures import Result, column_of, equations_of, result_figures, time_of
from .tables import error_table, parameter_table, unit_of
from .validation_tables import comparison_table, correlation_table, covariance_table

REVISED = "revision 1"
"""What the model with what was found is called, beside the model as it was given."""


def write_report(  # noqa: PLR0913 - every option of the command
    recording: Recording,
    structure: Structure,
    methods: Sequence[str],
    folder: Path,
    end: float = np.inf,
    smooth: Callable[[np.ndarray], np.ndarray] = lambda values: values,
    compared: str = "unfiltered",
    settings: Mapping[str, float] = {},
    effects: Mapping[str, Effect] = EFFECTS,
    markdown: bool = False,
    seconds: float | None = None,
    told: Callable[[str], None] = lambda line: None,
) -> Path:
    """Write `report.html` into the folder, with `markdown` also `report.md` and its figures -> the page.

    The settings go to the methods that have them; seconds: after which the diagnosis tries nothing more; `told` hears
    of each part when it is done, and how long it took.
    """
    structure, (recording,) = with_accelerations(structure, [recording])
    if not ((recording.time > 0.0) & (recording.time <= end)).any():
        raise ModelError(f"test {recording.test.id} has no samples between the impact and {end:g} s")
    step = partial(_timed, told)
    with step("diagnosis"):
        sentence, missing, better = _missing(recording, structure, end, effects, seconds)
    estimated = partial(_estimated, recording, end=end, effects=effects)
    results = {}
    for method in methods:
        with step(f"estimates by {method}"):
            results[method] = estimated(structure, method, settings=settings)
    best, given = methods[-1], applied(structure, recording.test, effects)
    runs = {best: (given, results[best])}
    if better:
        with step(f"estimates by {best} with what was found"):
            try:
                result = estimated(better, best, settings=settings)
            except ModelError as error:
                result, why = None, f"What follows is of the model as given, without what was found: {error}."
        missing += [Paragraph(_what_is_revised(structure, better) if result else why)]
        if result:
            runs[f"{best} {REVISED}"] = applied(better, recording.test, effects), result
            if result.description.equations == results[best].description.equations:
                results[f"{best} {REVISED}"] = result
    with step("free run"):
        runs_free = _free_runs(recording, runs, end, smooth, compared)
    with step("jumps"):
        jumps = _jumps(estimated(structure, "afmm", settings={}))
    masses = _masses(recording, given, end)
    blocks = [Paragraph(sentence), *missing, *_test(recording, given, end), *_tables(results)]
    blocks += [*result_figures(given, results), *runs_free, *jumps, *masses]
    page = Page(recording.test.title or recording.test.id, blocks)
    with step("page"), written_into(folder) as place:
        (place / "report.html").write_text(html_page(page), encoding="utf-8")
        if markdown:
            write_markdown_page(page, place)
    return folder / "report.html"


@contextmanager
def _timed(told: Callable[[str], None], what: str) -> Iterator[None]:
    began = time.process_time()
    yield
    told(f"{what}: {time.process_time() - began:.1f} s of processor")


def _estimated(
    recording: Recording, structure: Structure, method: str, end: float, settings: Mapping[str, Any],
    effects: Mapping[str, Effect],
) -> Result:  # fmt: skip
    estimator = make_estimator(structure, recording.test, method, effects=effects, **settings)
    estimates = run(estimator, (sample for sample in recording.samples() if sample.time <= end))
    whole = applied(structure, recording.test, effects)  # a load path of its effects is one more element
    return Result(estimator.description, estimates, validate(whole, estimator.description, estimates))


def _test(recording: Recording, structure: Structure, end: float) -> list[Block]:
    test = recording.test
    until = min(end, float(recording.time[-1]))
    bodies = [structure.bodies[k].name for k in structure.equations]
    elements = ", ".join(f"{e.name} ({e.between[0]}-{e.between[1]})" for e in structure.elements)
    lines = [
        f"test {test.id}, {len(recording)} samples every {recording.sample_period * 1e3:g} ms, "
        f"judged up to {until * 1e3:.0f} ms",
        f"model {structure.name}: equations of {', '.join(bodies)}; elements {elements}",
    ]
    known = [f"{spec.type} on {spec.target}" for spec in structure.effects]
    lines += [f"effects of the model: {', '.join(known)}"] if known else []
    lines += [f"source: {test.source}"] if test.source else []
    return [Heading("The test"), Bullets([*lines, *test.notes])]


def _missing(
    recording: Recording, structure: Structure, end: float, effects: Mapping[str, Effect], seconds: float | None
) -> tuple[str, list[Block], Structure | None]:
    """The page's first sentence, what `diagnose` says, the model with what it has found; None where that is nothing.

    Or why it says nothing: the rest is said all the same.
    """
    until = recording.time <= end
    judged = Recording(recording.test, recording.time_ns[until], recording.values[until])
    try:
        found = diagnose(structure, [judged], effects, seconds=seconds)
    except (ModelError, RecordingError) as error:
        why = f"What the model lacks was not searched for: {error}."
        return f"Model {structure.name} on test {recording.test.id}: parameters, errors and free run. {why}", [], None
    better = found.structure if found.steps and found.verdict != UNEXPLAINED else None
    return first_sentence(found, structure.name, recording.test.id), _what_is_missing(found), better


def _what_is_missing(found: Diagnosis) -> list[Block]:
    said = " ".join(f"{text[0].upper()}{text[1:]}." for text in (found.text, doubt(found)) if text)
    said += " Errors here are of the best fit with one curve for each element over the whole record."
    return [Heading("What is missing"), Paragraph(said), Lines(diagnosis_tables(found))]


def _what_is_revised(given: Structure, better: Structure) -> str:
    added = [f"{spec.type} on {spec.target}" for spec in better.effects if spec not in given.effects]
    return f"In all that follows, {REVISED} is the model with {' and '.join(added)}, in front of the model as given."


def _tables(results: dict[str, Result]) -> list[Block]:
    page: list[Block] = [Heading("Parameters")]
    for method, result in results.items():
        page += [Paragraph(method), Lines(parameter_table(result.description, result.estimates))]
    page += [Heading("Mean and variance of error, input and output (thesis tables 5.1 and 5.2)"), _variances(results)]
    page += [Heading("The error (tables 5.4 and 6.1)")]
    for method, result in results.items():
        validation = result.validation
        text = [error_table(validation.errors), covariance_table(validation), correlation_table(validation)]
        page += [Paragraph(method), Lines("\n\n".join(text))]
    return [*page, Paragraph("Cross-correlation of the error with the inputs, lag 0 (table 5.4):"), _cross(results)]


def _variances(results: dict[str, Result]) -> Table:
    rows = []
    for k, (name, _) in enumerate(equations_of(results)):
        errors = [result.validation.errors[k] for result in results.values()]
        shown, factor = unit_of(errors[0])
        rows.append(
            (f"input {name} ({shown})", *(_mean_variance(e.input_mean, e.input_variance, factor) for e in errors))
        )
        rows.append((f"output {name}", *(_mean_variance(e.output_mean, e.output_variance, factor) for e in errors)))
        rows.append((f"error {name}", *(_mean_variance(e.error_mean, e.error_variance, factor) for e in errors)))
    return Table(("mean, variance", *results), rows)


def _mean_variance(mean: float, variance: float, factor: float) -> str:
    return f"{mean * factor:.3g}, {variance * factor**2:.4g}"


def _cross(results: dict[str, Result]) -> Table:
    rows = []
    for method, result in results.items():
        for equation in result.validation.equations:
            values = [f"{name} {c.values[len(c.values) // 2]:+.2f}" for name, c in equation.cross.items()]
            rows.append((f"{equation.equation}, {method}", ", ".join(values)))
    return Table(("error of", "with"), rows)


def _free_runs(
    recording: Recording, runs: Mapping[str, tuple[Structure, Result]], end: float, smooth: Callable, compared: str
) -> list[Block]:
    """The best method's characteristics, simulated from the impact on (figures 4.16 to 4.19, 6.13, 6.14).

    runs: by method and revision, the newest last; the panels are those of the first.
    """
    simulated = {
        name: free_run(s, r.description, r.estimates, end=end, recording=recording) for name, (s, r) in runs.items()
    }
    structure, result = next(iter(runs.values()))
    first, panels = next(iter(simulated.values())), []
    colours = dict(zip(simulated, ("#d62728",) if len(runs) == 1 else ("#e7a3a3", "#2ca02c")))

    def panel(title: str, shown: str, measured: np.ndarray, column: Callable[[str], np.ndarray]) -> Panel:
        lines = [Line(first.time * 1e3, measured, "measured", "#555555")]
        lines += [Line(run.time * 1e3, column(name), name, colours[name]) for name, run in simulated.items()]
        return Panel(title, "time in ms", shown, lines)

    def predicted(column: Mapping[str, int], factor: float, name: str) -> np.ndarray:
        return smooth(simulated[name].predicted[:, column[name]]) * factor

    for k, (equation, unit) in enumerate(zip(result.description.equations, result.description.equation_units)):
        shown, factor = readable(unit, first.measured[:, k])
        at = {name: r.description.equations.index(equation) for name, (_, r) in runs.items()}
        panels.append(
            panel(
                f"{equation}, {compared}",
                shown,
                smooth(first.measured[:, k]) * factor,
                partial(predicted, at, factor),
            )
        )
    for k, body in enumerate(structure.bodies):
        if body.free and body.acceleration:
            at = {name: s.body_index[body.name] for name, (s, _) in runs.items()}
            column = lambda name, at=at: simulated[name].velocity[:, at[name]]  # noqa: E731
            panels.append(panel(f"{body.name}: velocity", "m/s", first.measured_velocity[:, k], column))
    blocks: list[Block] = [Heading("Free run (figures 4.16 to 4.19, 6.13, 6.14)")]
    for name, (s, r) in runs.items():
        said = f"The model with the characteristics from {name}, by Runge-Kutta from the initial velocities."
        blocks += [
            Paragraph(f"{said} {_slopes(s, r)}"),
            Lines(comparison_table(compare(s, r.description, simulated[name], smooth))),
        ]
    return [*blocks, Figure("free_run", panels)]


def _slopes(structure: Structure, result: Result) -> str:
    laws = characteristics(structure, result.description, result.estimates)
    slopes = ", ".join(f"{law.element} {law.unloading * 1e-3:.4g} kN/m" for law in laws if law.unloading is not None)
    return f"Unloading slopes: {slopes}." if slopes else "All elements unload as they load."


def _jumps(result: Result) -> list[Block]:
    found = [event for e in result.estimates for event in e.events if event.kind == "jump"]
    page: list[Block] = [Heading("Jumps of the parameters (figure 4.13)")]
    if not found:
        return [*page, Paragraph("None: the parameters change slowly, or the noise hides it.")]
    marks = [(float(event.text.split("jumped at ")[1].split(" ms")[0]), "") for event in found]
    measured = column_of(result.estimates, "measured", 0)
    shown, factor = readable(result.description.equation_units[0], measured)
    line = Line(time_of(result.estimates), measured * factor, colour="#999999")
    title = f"{result.description.equations[0]} and the jumps"
    panel = Panel(title, "time in ms", shown, [line], marks=marks)
    return [*page, Bullets([event.text for event in found]), Figure("jumps", [panel], columns=1)]


def _masses(recording: Recording, structure: Structure, end: float) -> list[Block]:
    """Effective masses, where the model has what they need (figures 4.12, 4.26)."""
    try:
        estimator = make_estimator(structure, recording.test, "effective_mass")
    except ModelError:
        return []
    estimates = run(estimator, (sample for sample in recording.samples() if sample.time <= end))
    names, last = estimator.description.parameters, estimates[-1]
    time_ms, sigma = time_of(estimates), partial(column_of, estimates, "std")
    lines = [Line(time_ms, column_of(estimates, "parameters", k), n, spread=sigma(k)) for k, n in enumerate(names)]
    panel = Panel("effective masses", "time in ms", "kg", lines, y_range=(0.0, 2.0 * float(last.parameters.sum())))
    found = ", ".join(f"{name} {m:.0f} +- {s:.0f} kg" for name, m, s in zip(names, last.parameters, last.std))
    text = f"{found}; together {last.parameters.sum():.0f} kg."
    return [Heading("Effective masses (figures 4.12, 4.26)"), Paragraph(text), Figure("masses", [panel], columns=1)]
