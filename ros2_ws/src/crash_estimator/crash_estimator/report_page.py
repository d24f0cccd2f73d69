"""The report on one recording: what the model lacks, the thesis's tables and figures, on one page."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np

from crash_replay.output import written_into
from crash_replay.recording import Recording, RecordingError
from crash_replay.shown_units import readable

from .core.characteristic import characteristics
from .core.diagnosis import Diagnosis, diagnose
from .core.effects import EFFECTS
from .core.effects.applied import applied
from .core.effects.effect import Effect
from .core.fold import run
from .core.free_run import compare, free_run
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
    seconds: float = np.inf,
    told: Callable[[str], None] = lambda line: None,
) -> Path:
    """Write `report.html` into the folder, with `markdown` also `report.md` and its figures -> the page.

    The settings go to the methods that have them; seconds: after which the diagnosis tries nothing more; `told` hears
    of each part when it is done, and how long it took.
    """
    if not ((recording.time > 0.0) & (recording.time <= end)).any():
        raise ModelError(f"test {recording.test.id} has no samples between the impact and {end:g} s")
    step = partial(_timed, told)
    with step("diagnosis"):
        sentence, missing = _missing(recording, structure, end, effects, seconds)
    estimated = partial(_estimated, recording, structure, end=end, effects=effects)
    structure = applied(structure, recording.test, effects)
    results = {}
    for method in methods:
        with step(f"estimates by {method}"):
            results[method] = estimated(method, settings=settings)
    best = methods[-1]
    with step("free run"):
        runs_free = _free_run(structure, results[best], best, end, smooth, compared)
    with step("jumps"):
        jumps = _jumps(estimated("afmm", settings={}))
    masses = _masses(recording, structure, end)
    blocks = [Paragraph(sentence), *missing, *_test(recording, structure, end), *_tables(results)]
    blocks += [*result_figures(structure, results), *runs_free, *jumps, *masses]
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
    recording: Recording, structure: Structure, method: str, end: float, settings: Mapping[str, float],
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
    recording: Recording, structure: Structure, end: float, effects: Mapping[str, Effect], seconds: float
) -> tuple[str, list[Block]]:
    """The page's first sentence and what `diagnose` says; or why it says nothing: the rest is said all the same."""
    until = recording.time <= end
    judged = Recording(recording.test, recording.time_ns[until], recording.values[until])
    try:
        found = diagnose(structure, [judged], effects, seconds=seconds)
    except (ModelError, RecordingError) as error:
        why = f"What the model lacks was not searched for: {error}."
        return f"Model {structure.name} on test {recording.test.id}: parameters, errors and free run. {why}", []
    return first_sentence(found, structure.name, recording.test.id), _what_is_missing(found)


def _what_is_missing(found: Diagnosis) -> list[Block]:
    said = " ".join(f"{text[0].upper()}{text[1:]}." for text in (found.text, doubt(found)) if text)
    said += " Errors here are of the best fit with one curve for each element over the whole record."
    return [Heading("What is missing"), Paragraph(said), Lines(diagnosis_tables(found))]


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


def _free_run(
    structure: Structure, result: Result, method: str, end: float, smooth: Callable, compared: str
) -> list[Block]:
    """The best method's characteristics, simulated from the impact on (figures 4.16 to 4.19, 6.13, 6.14)."""
    description, estimates = result.description, result.estimates
    simulated = free_run(structure, description, estimates, end=end)
    panels = []
    for k, (name, unit) in enumerate(zip(description.equations, description.equation_units, strict=True)):
        shown, factor = readable(unit, simulated.measured[:, k])
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
    laws = characteristics(structure, description, estimates)
    slopes = ", ".join(f"{law.element} {law.unloading * 1e-3:.4g} kN/m" for law in laws if law.unloading is not None)
    said = f"Unloading slopes: {slopes}." if slopes else "All elements unload as they load."
    return [
        Heading("Free run (figures 4.16 to 4.19, 6.13, 6.14)"),
        Paragraph(
            f"The model with the characteristics from {method}, by Runge-Kutta from the initial velocities. {said}"
        ),
        Lines(comparison_table(compare(structure, description, simulated, smooth))),
        Figure("free_run", panels),
    ]


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
    found = ", ".join(
        f"{name} {m:.0f} +- {s:.0f} kg" for name, m, s in zip(names, last.parameters, last.std, strict=True)
    )
    text = f"{found}; together {last.parameters.sum():.0f} kg."
    return [Heading("Effective masses (figures 4.12, 4.26)"), Paragraph(text), Figure("masses", [panel], columns=1)]
