"""Terminal tables of what an estimator found, in the units crash engineers read."""

from collections.abc import Mapping, Sequence

import numpy as np

from crash_replay.shown_units import readable

from .core.effects.effect import Effect
from .core.errors import EquationError
from .core.estimate import Description, Estimate, ParameterStatus
from .core.structure import EffectSpec

PEAK_PER_DEVIATION = 3.0
"""A signal's peak is taken to be so many of its standard deviations where only those are known."""

OF_ELEMENTS = ("N/m", "N*s/m", "kg")
"""Units in which a tenth is fine enough; an effect's coefficient, such as a gain of 0.07, may be of any size."""


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Columns as wide as their widest cell: the first to the left, the others to the right."""
    lines = [list(head), *[list(row) for row in rows]]
    widths = [max(len(line[k]) for line in lines) for k in range(len(head))]
    aligned = [
        "  ".join(cell.rjust(width) if k else cell.ljust(width) for k, (cell, width) in enumerate(zip(line, widths)))
        for line in lines
    ]
    return "\n".join(line.rstrip() for line in (aligned[0], "-" * len(aligned[0]), *aligned[1:]))


def parameter_table(description: Description, estimates: Sequence[Estimate]) -> str:
    """Every parameter where its element carries most, with sigma and status, and that peak force; a mass at the end."""
    rows = []
    element_of = {name: k for k, name in enumerate(description.elements)}
    peaks = np.abs([estimate.force for estimate in estimates]).max(axis=0, initial=0.0)
    force_unit, per_newton = readable("N", peaks)
    for k, (name, unit) in enumerate(zip(description.parameters, description.parameter_units)):
        element = element_of.get(name.rsplit(".", 1)[0])
        peak = estimates[-1] if element is None else max(estimates, key=lambda estimate: abs(estimate.force[element]))
        shown, factor = readable(unit, [peak.parameters[k]])
        known = ParameterStatus(peak.status[k]) == ParameterStatus.KNOWN
        value, sigma = (".1f", ".1f") if unit in OF_ELEMENTS else (".4g", ".2g")
        rows.append(
            (
                name,
                f"{peak.parameters[k] * factor:{value}}",
                "" if known else f"{peak.std[k] * factor:{sigma}}",
                shown,
                ParameterStatus(peak.status[k]).name.lower(),
                f"{peak.time_ns * 1e-6:.1f}",
                "" if element is None else millimetres(peak.crush[element]),
                "" if element is None else f"{peak.force[element] * per_newton:.2f}",
            )
        )
    head = ("parameter at peak force", "value", "sigma", "unit", "status", "at ms", "crush mm", f"force {force_unit}")
    return table(head, rows)


def larger_than_measured(errors: Sequence[EquationError]) -> str:
    """Of equations whose error scatters more than what was measured; "" where there are none."""
    lost = [row.equation for row in errors if row.error_variance > row.input_variance]
    if not lost:
        return ""
    return (
        f"{', '.join(lost)}: the error is larger than what was measured, so these parameters say nothing of it; "
        "another --method may, and `diagnose` says what the model lacks"
    )


def millimetres(length: float) -> str:
    """Of a crush in m: a car's to the millimetre, a small rig's to its third digit."""
    return f"{length * 1e3:.0f}" if abs(length) >= 0.1 else f"{length * 1e3:.3g}"


def unit_of(row: EquationError) -> tuple[str, float]:
    """The unit in which an equation's signal is shown, and the factor to it."""
    return readable(row.unit, [PEAK_PER_DEVIATION * np.sqrt(row.input_variance)])


def never_touches(name: str) -> str:
    """Of an element that is apart in all of a recording."""
    return f"{name} never touches (the first body of its `between` is the one that runs into the other)"


def known_effects_table(given: Sequence[EffectSpec], effects: Mapping[str, Effect], description: Description) -> str:
    """Effects with a known coefficient that is no parameter: it is in an element, a mass or the samples; or nothing."""
    rows = [
        (spec.type, spec.target, f"{spec.coefficient:.4g}", effects[spec.type].unit, "known")
        for spec in given
        if spec.coefficient is not None and f"{spec.target}.{spec.type}" not in description.parameters
    ]
    return table(("effect of the model", "on", "value", "unit", "status"), rows) if rows else ""


def besides_table(description: Description, last: Estimate) -> str:
    """What the method knows besides the parameters, after the last sample: a noise model, weights, masses."""
    rows = [
        (name, f"{value:.4g}", "" if np.isnan(std) else f"{std:.2g}", unit)
        for name, value, std, unit in zip(description.extra, last.extra, last.extra_std, description.extra_units)
        if not np.isnan(value)
    ]
    return table(("method, after the last sample", "value", "sigma", "unit"), rows)


def error_table(errors: Sequence[EquationError]) -> str:
    """Mean and standard deviation of measurement and error per equation (tables 5.1 and 5.2 give variances), and RMS of
    the error."""
    rows = []
    for row in errors:
        shown, factor = unit_of(row)
        share = row.error_variance / row.input_variance if row.input_variance else np.nan
        rows.append(
            (
                row.equation,
                shown,
                f"{row.input_mean * factor:.2f}",
                f"{np.sqrt(row.input_variance) * factor:.2f}",
                f"{row.error_mean * factor:.3f}",
                f"{np.sqrt(row.error_variance) * factor:.3f}",
                f"{row.rms * factor:.3f}",
                f"{1.0 - share:.1%}",
            )
        )
    head = ("equation", "unit", "measured mean", "sd", "error mean", "sd", "RMS", "explained")
    return table(head, rows)
