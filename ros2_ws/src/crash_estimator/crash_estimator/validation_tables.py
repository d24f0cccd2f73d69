"""Terminal tables of a validation and of a free run."""

import numpy as np

from crash_replay.shown_units import readable

from .core.compare_free_run import Comparison
from .core.validation import LEVELS, Validation
from .tables import table, unit_of


def correlation_table(validation: Validation) -> str:
    """Per equation: is the error uncorrelated, and what it goes along with most; limits at 90, 95 and 99 %."""
    rows = []
    for equation in validation.equations:
        if equation.auto is None:
            rows.append((equation.equation, str(equation.samples), *["-"] * 6))
            continue
        passed = [f"{level:.0%}" for level in LEVELS if equation.uncorrelated(level)]
        name, share = strongest_input(equation.cross)
        rows.append(
            (
                equation.equation,
                str(equation.samples),
                f"{equation.auto.values[1]:+.2f}",
                *(f"{equation.auto.inside(level):.0%}" for level in LEVELS),
                f"at {passed[0]}" if passed else "no",
                f"{name} {share:.1f}",
            )
        )
    lags = next((e.degrees for e in validation.equations if e.auto is not None), 0)
    inside = [f"lags in {level:.0%}" for level in LEVELS]
    head = (f"{validation.what} of", "samples", "lag 1", *inside, "uncorrelated", "largest with / 99 % limit")
    note = f"({lags} lags; uncorrelated: Ljung and Box's Q; one lag in twenty leaves its 95 % limit by chance)"
    return f"{table(head, rows)}\n{note}"


def strongest_input(cross: dict) -> tuple[str, float]:
    """The input with the largest cross-correlation in units of its 99 % limit, and that number."""
    if not cross:
        return "none", 0.0
    shares = {name: float(np.abs(c.values).max() / c.limit(0.99)) for name, c in cross.items()}
    name = max(shares, key=shares.__getitem__)
    return name, shares[name]


def covariance_table(validation: Validation) -> str:
    """The error covariance matrix in the units of the equations, and the correlation coefficients beside it."""
    names = [equation.equation for equation in validation.equations]
    rows = [
        (
            f"{name} ({unit_of(e)[0]})",
            *(f"{x:.4g}" for x in _shown(validation, k)),
            "",
            *(f"{r:+.2f}" for r in validation.correlation[k]),
        )
        for k, (name, e) in enumerate(zip(names, validation.errors))
    ]
    return table(("covariance of the error", *names, "correlation:", *names), rows)


def _shown(validation: Validation, row: int) -> np.ndarray:
    factors = np.array([unit_of(e)[1] for e in validation.errors])
    return validation.covariance[row] * factors[row] * factors


def comparison_table(comparisons: list[Comparison]) -> str:
    """Simulated against measured, with the ISO/TS 18571 rating."""
    rows = []
    for c in comparisons:
        shown, factor = readable(c.unit, [c.measured_peak])
        r = c.rating
        rows.append(
            (
                c.name,
                shown,
                f"{c.measured_peak * factor:.2f}",
                f"{c.simulated_peak * factor:.2f}",
                f"{c.rms * factor:.3f}",
                *(("-",) * 6 if r is None else (*(f"{x:.2f}" for x in r[:5]), r.grade)),
            )
        )
    head = (
        "free run",
        "unit",
        "measured peak",
        "simulated",
        "rms",
        "corridor",
        "phase",
        "magnitude",
        "slope",
        "rating",
        "ISO 18571",
    )
    return table(head, rows)
