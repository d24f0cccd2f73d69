"""Rating of a simulated signal against a measured one by ISO/TS 18571 (non-ambiguous signals).

    R = 0.4 Z + 0.2 E_P + 0.2 E_M + 0.2 E_S,    each from 0 (no correlation) to 1

    corridor  Z    mean over time of 1 within 5 % of the reference's peak, 0 beyond 50 %, a parabola in between
    phase     E_P  1 - |shift| / (20 % of the duration), the shift being that of the largest cross-correlation
    magnitude E_M  1 - e / 0.5,  e = |C - T|_1 / |T|_1 after the shift and dynamic time warping
    slope     E_S  1 - e / 2,    e = |C' - T'|_1 / |T'|_1 after the shift, slopes smoothed over 9 samples

T is the reference (measured), C the comparison (simulated). The standard asks for 10 kHz; the shares of the duration
make the rating hold for other rates, but for the slope's smoothing, which is counted in samples.
"""

from typing import NamedTuple

import numpy as np

INNER, OUTER = 0.05, 0.5
"""Half widths of the corridors, shares of the reference's peak."""
LARGEST_SHIFT = 0.2
"""Share of the duration."""
WARPING = 0.1
"""Half width of the band of the time warping, share of the length."""
LARGEST_MAGNITUDE_ERROR, LARGEST_SLOPE_ERROR = 0.5, 2.0
SMOOTHING = 9
"""Samples over which slopes are averaged; fewer at the ends."""

ROUNDING = 1e-12
"""Correlations closer than this are the same."""

GRADES = ((0.94, "excellent"), (0.80, "good"), (0.58, "fair"), (-1.0, "poor"))
"""Of the overall rating, the sliding scale of the standard."""


class Rating(NamedTuple):
    corridor: float
    phase: float
    magnitude: float
    slope: float
    overall: float
    shift: int  # samples by which the comparison is late

    @property
    def grade(self) -> str:
        return next(name for least, name in GRADES if self.overall > least)


def rate(reference: np.ndarray, comparison: np.ndarray) -> Rating:
    """The rating of a comparison (n,) against a reference (n,) on the same time base with equal steps, n >= 10.

    Raises ValueError where the signals do not match, are too short or have gaps; a reference without any signal
    has no scale to rate by, and is refused as well.
    """
    if reference.shape != comparison.shape or reference.ndim != 1 or len(reference) < SMOOTHING + 1:
        raise ValueError(
            f"a rating needs two signals of the same length, at least {SMOOTHING + 1} samples, "
            f"got {reference.shape} and {comparison.shape}"
        )
    if not (np.isfinite(reference).all() and np.isfinite(comparison).all()):
        raise ValueError("a rating needs signals without gaps")
    if not np.ptp(reference) > 0.0:
        raise ValueError("a rating needs a reference that changes, got a constant one")
    unit = max(np.abs(reference).max(), np.abs(comparison).max())  # in it no square is beyond all numbers
    reference, comparison = reference / unit, comparison / unit
    shift = _shift(reference, comparison)
    n = len(reference) - abs(shift)
    t, c = (reference[:n], comparison[shift:]) if shift >= 0 else (reference[-n:], comparison[:n])
    corridor = _corridor(reference, comparison)
    phase = 1.0 - min(abs(shift) / (LARGEST_SHIFT * len(reference)), 1.0)
    magnitude = _score(*_warped(c, t), LARGEST_MAGNITUDE_ERROR)
    slope = _score(_smoothed(np.gradient(c)), _smoothed(np.gradient(t)), LARGEST_SLOPE_ERROR)
    overall = 0.4 * corridor + 0.2 * (phase + magnitude + slope)
    return Rating(corridor, phase, magnitude, slope, overall, shift)


def _corridor(reference: np.ndarray, comparison: np.ndarray) -> float:
    peak = np.abs(reference).max()
    within = (OUTER * peak - np.abs(reference - comparison)) / ((OUTER - INNER) * peak)
    return float(np.mean(np.clip(within, 0.0, 1.0) ** 2))


def _shift(reference: np.ndarray, comparison: np.ndarray) -> int:
    """Samples by which the comparison is late, within a fifth of the length; the smallest of equally good ones."""
    n = len(reference)
    shifts = np.arange(1 - n, n)
    shared = n - np.abs(shifts)
    t, c = reference - reference.mean(), comparison - comparison.mean()

    def over_shared(values: np.ndarray, late: np.ndarray) -> np.ndarray:
        """Sums over what a signal shares with the other one, by shift."""
        sums = np.concatenate([[0.0], np.cumsum(values)])
        first = np.maximum(late, 0)
        return sums[first + shared] - sums[first]

    of_t, of_c = over_shared(t, -shifts), over_shared(c, shifts)
    together = np.correlate(c, t, "full") - of_t * of_c / shared
    spread = [over_shared(x * x, late) - sums**2 / shared for x, late, sums in ((t, -shifts, of_t), (c, shifts, of_c))]
    scale = np.sqrt(np.maximum(spread[0], 0.0) * np.maximum(spread[1], 0.0))
    flat = scale <= ROUNDING * n * np.abs(t).max() * np.abs(c).max()  # a constant signal has no correlation
    pearson = np.where(flat, -1.0, together / np.where(flat, 1.0, scale))
    within = np.flatnonzero(np.abs(shifts) <= int(np.floor(LARGEST_SHIFT * n)))
    nearest = within[np.argsort(np.abs(shifts[within]) - 0.5 * (shifts[within] > 0))]
    best = pearson[nearest] >= pearson[nearest].max() - ROUNDING
    return int(shifts[nearest[np.argmax(best)]])


def _score(comparison: np.ndarray, reference: np.ndarray, largest: float) -> float:
    error, scale = np.abs(comparison - reference).sum(), np.abs(reference).sum()
    if scale == 0.0:
        return 1.0 if error == 0.0 else 0.0
    return float(1.0 - min(error / scale / largest, 1.0))


def _smoothed(slope: np.ndarray) -> np.ndarray:
    """Means over 9 samples, over 7, 5, 3 and 1 at the ends."""
    half, sums = SMOOTHING // 2, np.concatenate([[0.0], np.cumsum(slope)])
    k = np.arange(len(slope))
    reach = np.minimum(np.minimum(k, len(slope) - 1 - k), half)
    return (sums[k + reach + 1] - sums[k - reach]) / (2 * reach + 1)


def _warped(c: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The two signals along the path of least summed squared difference within the band."""
    from .time_warping import warping_path  # the compiler takes long to import: only who needs it waits for it

    n = len(t)
    radius = min(n, max(1, int(np.ceil(WARPING * n)))) - 1
    c, t = (np.ascontiguousarray(x, dtype=float) for x in (c, t))
    rows, columns = warping_path(c, t, radius)
    return c[rows], t[columns]
