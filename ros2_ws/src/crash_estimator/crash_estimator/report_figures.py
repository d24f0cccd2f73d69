"""The report's figures of what several methods found: outputs, errors, characteristics, correlations."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from crash_replay.shown_units import readable

from .core.estimate import Description, ElementState, Estimate, ParameterStatus
from .core.sensor_noise import sensor_noise
from .core.structure import Structure
from .core.validation import LEVELS, Validation
from .figures import Line, Panel
from .page_blocks import Block, Figure, Heading
from .tables import unit_of

BAND = 2.576
"""Standard deviations on each side that hold 99 % of a normal distribution."""


class Result(NamedTuple):
    """What one method found."""

    description: Description
    estimates: list[Estimate]
    validation: Validation


def result_figures(structure: Structure, results: dict[str, Result]) -> list[Block]:
    first = next(iter(results.values()))
    outputs, errors, correlations = [], [], []
    for k, (name, _) in enumerate(equations_of(results)):
        shown, factor = unit_of(first.validation.errors[k])
        measured = column_of(first.estimates, "measured", k) * factor
        lines = [Line(time_of(first.estimates), measured, "measured", "#bbbbbb")]
        lines += [
            Line(time_of(r.estimates), column_of(r.estimates, "predicted", k) * factor, m) for m, r in results.items()
        ]
        outputs.append(Panel(f"{name}: measured and estimated", "time in ms", shown, lines))
        lines = [
            Line(time_of(r.estimates), column_of(r.estimates, "residual", k) * factor, m) for m, r in results.items()
        ]
        band = BAND * _noise(first, k) * factor
        levels = [(band, "99 % of the noise"), (-band, "")]
        errors.append(Panel(f"{name}: error", "time in ms", shown, lines, levels))
        correlations += _correlations(k, results)
    page: list[Block] = [
        Heading("Estimated outputs (figures 5.5, 5.12, 5.18)"),
        Figure("outputs", outputs),
        Figure("errors", errors),
    ]
    page += [Heading("Stiffness and force over crush (figures 5.4, 5.11, 6.9, 6.12)")]
    page += [Figure("characteristics", _characteristics(structure, results))]
    if correlations:
        page += [Heading("Correlation of the error (figures 5.13 to 5.15, 5.19 to 5.21)")]
        page += [Figure("correlations", correlations, columns=3, height=2.2)]
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
        curves = {}
        for method, result in results.items():
            after = [e for e in result.estimates if e.time_ns >= 0 and e.state[k] != ElementState.APART]
            curves[method] = after, np.array([e.crush[k] for e in after]) * 1e3
        force_unit, per_newton = readable("N", [e.force[k] for after, _ in curves.values() for e in after])
        stiffness_unit, per_slope = ("kN/m", 1e-3) if force_unit == "kN" else ("N/m", 1.0)
        stiffness, force = [], []
        for method, (after, crush) in curves.items():
            index = results[method].description.parameters.index(f"{element.name}.stiffness")
            held = (ParameterStatus.KNOWN, ParameterStatus.APART)
            if after and after[-1].status[index] not in held:
                value, std = (
                    np.array([getattr(e, f)[index] for e in after]) * per_slope for f in ("parameters", "std")
                )
                stiffness.append(Line(crush, value, method, spread=std))
            force.append(Line(crush, np.array([e.force[k] for e in after]) * per_newton, method))
        if stiffness:
            top = max(float(np.nanmax(line.y)) for line in stiffness)
            title, limits = f"{element.name}: stiffness", (0.0, 1.1 * top or 1.0)
            panels.append(Panel(title, "crush in mm", stiffness_unit, stiffness, y_range=limits))
        panels.append(Panel(f"{element.name}: force", "crush in mm", force_unit, force))
    return panels


def _noise(result: Result, k: int) -> float:
    """Standard deviation of the sensors' own noise in an equation's measurement."""
    measured = column_of(result.estimates, "measured", k)
    valid = np.isfinite(measured)
    time_ns = np.array([e.time_ns for e in result.estimates])
    return sensor_noise(measured[valid], time_ns[valid], rests=True).of_one_sample


def equations_of(results: dict[str, Result]) -> list[tuple[str, str]]:
    description = next(iter(results.values())).description
    return list(zip(description.equations, description.equation_units))


def time_of(estimates: Sequence[Estimate]) -> np.ndarray:
    return np.array([e.time_ns for e in estimates]) * 1e-6


def column_of(estimates: Sequence[Estimate], field: str, k: int) -> np.ndarray:
    return np.array([getattr(e, field)[k] for e in estimates])
