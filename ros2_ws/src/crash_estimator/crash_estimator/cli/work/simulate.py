"""`simulate`: a model that runs free from the impact, compared with what was measured."""

import argparse

import numpy as np

from crash_replay.conditioning import cfc_filter
from crash_replay.recording import Recording
from crash_replay.said import say
from crash_replay.shown_units import readable

from ...core.characteristic import Characteristic, characteristics
from ...core.compare_free_run import Comparison, compare
from ...core.derived_motion import with_accelerations
from ...core.effects.applied import applied
from ...core.fold import run
from ...core.free_run import FreeRun, free_run
from ...core.methods import make_estimator
from ...core.structure import ModelError, Structure
from ...model_file import load_model
from ...tables import millimetres, table
from ...validation_tables import comparison_table
from ..common import check_written, effects_of, parse_settings, read_crash, refuse_empty_channels, write_json

FILTER = 60
"""CFC of signals that are rated, unless told otherwise: that of a vehicle structure's acceleration (SAE J211-1)."""


def simulate(arguments: argparse.Namespace) -> None:
    check_written(arguments, arguments.bag, arguments.source, json=arguments.json)
    effects = effects_of(arguments)
    model = as_given = load_model(arguments.model, effects)
    settings = parse_settings(arguments.set) | {"effects": effects}
    recording = read_crash(arguments.bag)
    if not arguments.end > 0.0:
        raise ModelError(f"--end must be a time after the impact, above 0 s, got {arguments.end:g}")
    refuse_empty_channels(model, recording)
    model, (recording,) = with_accelerations(model, [recording])
    estimator = make_estimator(model, recording.test, arguments.method, **settings)
    estimates = run(estimator, recording.samples())
    description, structure = estimator.description, applied(model, recording.test, effects)
    laws = characteristics(structure, description, estimates)
    if arguments.source:
        other = read_crash(arguments.source)
        refuse_empty_channels(as_given, other)
        _, (other,) = with_accelerations(as_given, [other])
        donor = make_estimator(model, other.test, arguments.method, **settings)
        laws = characteristics(structure, donor.description, run(donor, other.samples()))
    simulated = free_run(structure, description, estimates, laws, arguments.end, recording)
    smooth, said = smoother(recording, arguments.cfc)
    comparisons = compare(structure, description, simulated, smooth)
    origin = f"forces over crush of {other.test.id}" if arguments.source else "its own forces over crush"
    if arguments.json:  # files before words: `| head` ends this at a line that nobody reads
        write_json(arguments.json, as_json(recording, structure, simulated, laws, comparisons, said))
    say(f"{recording.test.id}: free run of {description.model} with {origin}, {description.method}; compared {said}\n")
    say(f"{characteristic_table(laws)}\n")
    say(comparison_table(comparisons))


def smoother(recording: Recording, cfc: int | None):
    """A filter for the signals that are compared, and what to say of it; None: CFC 60 where the sample rate allows."""
    period = recording.sample_period
    if cfc is None and period * FILTER * 10 <= 1.0:
        cfc = FILTER
    return (
        (lambda values: cfc_filter(values, period, cfc), f"at CFC {cfc}")
        if cfc
        else (lambda values: values, "unfiltered")
    )


def characteristic_table(laws: tuple[Characteristic, ...]) -> str:
    unit, factor = readable("N", [float(np.abs(law.force).max()) for law in laws])
    slope_unit, per_slope = readable("N/m", [law.unloading or 0.0 for law in laws])
    rows = []
    for law in laws:
        size = np.abs(law.force)
        k = len(size) - 1 - int(np.argmax(size[::-1]))  # of two sides that are alike the one in compression
        slope = "elastic" if law.unloading is None else f"{law.unloading * per_slope:.0f}"
        largest = f"{law.force[k] * factor:.2f}"
        rows.append(
            (law.element, millimetres(law.crush.max()), largest, millimetres(law.crush[k]), slope, f"{law.damping:.0f}")
        )
    head = ("force over crush of", "crush mm", f"largest {unit}", "at mm", f"unloading {slope_unit}", "damping N s/m")
    return table(head, rows)


def as_json(
    recording: Recording,
    structure: Structure,
    simulated: FreeRun,
    laws: tuple[Characteristic, ...],
    comparisons: list[Comparison],
    filtered: str,
) -> dict:
    """Everything in SI units; series over `time` in s."""
    bodies = [body.name for body in structure.bodies]
    elements = [element.name for element in structure.elements]
    equations = [bodies[k] for k in structure.equations]

    def series(values: np.ndarray, names: list[str]) -> dict:
        return {name: values[:, k] for k, name in enumerate(names)}

    return {
        "test": recording.test.id,
        "model": structure.name,
        "compared": filtered,
        "equation_units": dict(zip(equations, structure.equation_units)),
        "characteristics": {law.element: law._asdict() for law in laws},
        "comparisons": {
            c.name: c._asdict()
            | {"rating": None if c.rating is None else c.rating._asdict() | {"grade": c.rating.grade}}
            for c in comparisons
        },
        "series": {
            "time": simulated.time,
            "measured": series(simulated.measured, equations),
            "simulated": series(simulated.predicted, equations),
            "displacement": series(simulated.displacement, bodies),
            "velocity": series(simulated.velocity, bodies),
            "measured_velocity": series(simulated.measured_velocity, bodies),
            "crush": series(simulated.crush, elements),
            "force": series(simulated.force, elements),
        },
    }
