"""`estimate`: a recording folded through an estimator, and what it found."""

import argparse
from typing import Any

import numpy as np

from crash_replay.recording import Recording
from crash_replay.said import say

from ...core.derived_motion import with_accelerations
from ...core.errors import EquationError, equation_errors
from ...core.estimate import Description, ElementState, Estimate, ParameterStatus
from ...core.fold import run
from ...core.kinematics import FEWEST
from ...core.methods import AnyEstimator, make_estimator
from ...core.passes import most_passes, repeats, settle
from ...core.structure import Structure
from ...model_file import load_model
from ...tables import (
    besides_table,
    error_table,
    known_effects_table,
    larger_than_measured,
    never_touches,
    parameter_table,
)
from ..common import check_written, effects_of, parse_settings, read_crash, refuse_empty_channels, write_json


def estimate(arguments: argparse.Namespace) -> None:
    check_written(arguments, arguments.bag, json=arguments.json)
    effects = effects_of(arguments)
    structure = load_model(arguments.model, effects)
    recording = read_crash(arguments.bag)
    refuse_empty_channels(structure, recording)
    structure, (recording,) = with_accelerations(structure, [recording])
    settings = parse_settings(arguments.set) | ({"effective_mass": True} if arguments.effective_mass else {})

    def make(**start: Any) -> AnyEstimator:
        return make_estimator(structure, recording.test, arguments.method, effects=effects, **settings, **start)

    estimator = make()
    most = most_passes(arguments.passes, settings.get("preset", "") or structure.preset)
    passes = settle(lambda start: make(start=start), recording, most) if repeats(estimator) else None
    estimates = passes.estimates if passes else run(estimator, recording.samples())
    description, errors = estimator.description, equation_errors(estimator.description, estimates)
    if arguments.json:  # files before words: `| head` ends this at a line that nobody reads
        content = as_json(recording, description, estimates, errors)
        write_json(arguments.json, content | ({"passes": passes.as_json()} if passes else {}))
    say(f"{recording.test.id}: {len(recording)} samples, model {description.model}, method {description.method}\n")
    say(f"{parameter_table(description, estimates)}\n")
    if known := known_effects_table(structure.effects, effects, description):
        say(f"{known}\n")
    say(error_table(errors))
    if lost := larger_than_measured(errors):
        say(f"\n{lost}")
    if unknown := without_noise(structure, recording):
        say(f"\n{unknown}")
    for k, name in enumerate(description.elements):
        if all(estimate.state[k] == ElementState.APART for estimate in estimates):
            say(f"\n{never_touches(name)}")
    if passes:
        say(f"\n{passes.text}")
    if description.extra:
        say(f"\n{besides_table(description, estimates[-1])}")


def without_noise(structure: Structure, recording: Recording) -> str:
    """Of equations whose measurement's noise is neither stated nor recorded; "" where there are none."""
    bodies = [structure.bodies[k] for k in structure.equations]
    names = [body.name for body in bodies if not body.noise]
    if not names or np.count_nonzero(recording.time_ns < 0) >= FEWEST:
        return ""
    return (
        f"{', '.join(names)}: fewer than {FEWEST} samples before time zero tell the noise, so the sigmas may be far "
        "too small; record 20 ms before it, or state `noise` of these bodies"
    )


def as_json(
    recording: Recording, description: Description, estimates: list[Estimate], errors: list[EquationError]
) -> dict:
    """Final values, the errors per equation, every event and every series; units are in `units`."""
    last = estimates[-1]

    def series(field: str, names: tuple[str, ...]) -> dict:
        values = np.array([getattr(estimate, field) for estimate in estimates])
        return {name: values[:, k] for k, name in enumerate(names)}

    return {
        "test": recording.test.id,
        "model": description.model,
        "method": description.method,
        "samples": len(recording),
        "units": dict(zip(description.parameters, description.parameter_units))
        | dict(zip(description.equations, description.equation_units))
        | dict(zip(description.extra, description.extra_units)),
        "parameters": {
            name: {
                "value": float(last.parameters[k]),
                "std": float(last.std[k]),
                "unit": description.parameter_units[k],
                "status": ParameterStatus(last.status[k]).name.lower(),
            }
            for k, name in enumerate(description.parameters)
        },
        "besides": {
            name: {"value": value, "std": std, "unit": unit}
            for name, unit, value, std in zip(description.extra, description.extra_units, last.extra, last.extra_std)
        },
        "equations": {row.equation: row._asdict() for row in errors},
        "events": [
            {"number": estimate.number, "time": estimate.time_ns * 1e-9} | event._asdict()
            for estimate in estimates
            for event in estimate.events
        ],
        "series": {
            "time": recording.time,
            "parameters": series("parameters", description.parameters),
            "std": series("std", description.parameters),
            "status": series("status", description.parameters),
            "besides": series("extra", description.extra),
            "measured": series("measured", description.equations),
            "predicted": series("predicted", description.equations),
            "innovation": series("innovation", description.equations),
            "residual": series("residual", description.equations),
            "crush": series("crush", description.elements),
            "rate": series("rate", description.elements),
            "force": series("force", description.elements),
            "force_std": series("force_std", description.elements),
            "state": series("state", description.elements),
        },
    }
