"""Is what is left over noise? Correlations of the residual, its covariance, mean and variance (thesis 3.7).

    auto-correlation          rho_rr(i) = sum r_k r_{k+i} / sum r_k^2,     limit  p / sqrt(N)
    cross-correlation         rho_ru(i) = sum r_{k+i} u_k / (N s_r s_u),   limit  p sqrt(P / N)
                              P = sum over all lags of rho_rr(i) rho_uu(i)
    all lags together         Q = N (N + 2) sum over i = 1..L of rho_rr(i)^2 / (N - i)   (Ljung and Box)

p = 1.65, 1.96, 2.58 for 90, 95, 99 %. The limits hold for each lag on its own: of twenty lags of white noise one is
beyond the 95 % limit. Whether a residual is uncorrelated is therefore decided by Q, which is chi-square with L degrees
of freedom; u are the crush and the rate of each element in the equation. Such a residual is not called white: that word
is for what passes the diagnosis's band test (`core.diagnosis.residuals.band_test`), which knows the sensors' noise.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .errors import EquationError, equation_errors
from .estimate import Description, Estimate
from .structure import Structure

LEVELS = {0.90: 1.65, 0.95: 1.96, 0.99: 2.58}
"""Confidence level -> p, the thesis's values of the normal distribution's two-sided quantile."""

NORMAL_QUANTILE = {0.90: 1.2816, 0.95: 1.6449, 0.99: 2.3263}
"""One-sided, for the chi-square quantile."""

FEWEST = 20
"""Samples below which nothing is said of correlation."""


class Correlation(NamedTuple):
    lags: np.ndarray  # (m,) samples
    values: np.ndarray  # (m,)
    spread: float  # standard deviation of a value if there is no correlation: 1 / sqrt(N) or sqrt(P / N)

    def limit(self, level: float) -> float:
        """What a value at one lag exceeds with probability 1 - level by chance."""
        return LEVELS[level] * self.spread

    def inside(self, level: float) -> float:
        """Share of the lags within the limit; the auto-correlation's lag 0 does not count."""
        counted = self.values[self.lags != 0] if self.lags[0] == 0 else self.values
        return float(np.mean(np.abs(counted) <= self.limit(level)))


class EquationValidation(NamedTuple):
    equation: str
    unit: str
    samples: int
    auto: Correlation | None  # None: too few samples
    cross: dict[str, Correlation]  # by input: "car_barrier.crush", "car_barrier.rate"
    q: float  # Ljung and Box
    degrees: int  # L

    def uncorrelated(self, level: float) -> bool:
        """By the test of Ljung and Box."""
        return self.auto is not None and self.q <= chi_square_quantile(level, self.degrees)


class Validation(NamedTuple):
    what: str  # residual or innovation
    errors: list[EquationError]
    equations: list[EquationValidation]
    covariance: np.ndarray  # (q, q) of the error, in the equations' units
    correlation: np.ndarray  # (q, q)


def validate(
    structure: Structure,
    description: Description,
    estimates: Sequence[Estimate],
    lags: int = 20,
    what: str = "residual",
    start: float = 0.0,
    end: float = np.inf,
) -> Validation:
    """Judge what an estimator left over between two times in s; what: residual (after the update) or innovation."""
    chosen = [e for e in estimates if start <= e.time_ns * 1e-9 <= end]
    series = np.array([getattr(e, what) for e in chosen]).reshape(len(chosen), len(description.equations))
    equations = []
    for row, (name, unit) in enumerate(zip(description.equations, description.equation_units)):
        valid = np.isfinite(series[:, row])
        inputs = {
            f"{element}.{kind}": np.array([getattr(e, kind)[k] for e in chosen])[valid]
            for k, element in enumerate(description.elements)
            if structure.force_to_equation[row, k] != 0.0
            for kind in ("crush", "rate")
        }
        equations.append(_equation(name, unit, series[valid, row], inputs, lags))
    complete = series[np.isfinite(series).all(axis=1)]
    q = len(description.equations)
    covariance = np.cov(complete, rowvar=False).reshape(q, q) if len(complete) > 1 else np.full((q, q), np.nan)
    scale = np.sqrt(np.diagonal(covariance))
    return Validation(
        what, equation_errors(description, chosen), equations, covariance, covariance / np.outer(scale, scale)
    )


def _equation(
    name: str, unit: str, residual: np.ndarray, inputs: dict[str, np.ndarray], lags: int
) -> EquationValidation:
    n, lags = len(residual), min(lags, len(residual) // 4)
    if n < FEWEST or not np.ptp(residual) > 0.0:
        return EquationValidation(name, unit, n, None, {}, np.nan, lags)
    auto = autocorrelation(residual, lags)
    q = n * (n + 2) * float(np.sum(auto.values[1:] ** 2 / (n - auto.lags[1:])))
    cross = {u: cross_correlation(residual, values, lags) for u, values in inputs.items() if np.ptp(values) > 0.0}
    return EquationValidation(name, unit, n, auto, cross, q, lags)


def autocorrelation(residual: np.ndarray, lags: int) -> Correlation:
    """At lags 0 to `lags`, about the mean."""
    r = _centred(residual)
    values = _products(r, r)[: lags + 1]
    return Correlation(np.arange(lags + 1), values, 1.0 / np.sqrt(len(r)))


def cross_correlation(residual: np.ndarray, inputs: np.ndarray, lags: int) -> Correlation:
    """At lags -`lags` to `lags`; at a positive one the residual comes after the input."""
    r, u = _centred(residual), _centred(inputs)
    n = len(r)
    values = np.concatenate([_products(u, r)[lags:0:-1], _products(r, u)[: lags + 1]])
    both = _products(r, r) * _products(u, u)
    p = max(both[0] + 2.0 * float(both[1:].sum()), 1.0 / n)  # a sample's sum may come out below 0
    return Correlation(np.arange(-lags, lags + 1), values, np.sqrt(p / n))


def _centred(values: np.ndarray) -> np.ndarray:
    """About the mean, sum of squares 1."""
    values = values - values.mean()
    return values / np.sqrt(values @ values)


def _products(later: np.ndarray, earlier: np.ndarray) -> np.ndarray:
    """(n,) sum over k of later[k + i] earlier[k] for i = 0..n-1, by fast convolution."""
    n = len(later)
    size = 1 << (2 * n - 1).bit_length()
    return np.fft.irfft(np.fft.rfft(later, size) * np.conj(np.fft.rfft(earlier, size)), size)[:n]


def chi_square_quantile(level: float, degrees: int) -> float:
    """Wilson and Hilferty: d (1 - 2/(9 d) + z sqrt(2/(9 d)))^3, within 1 % from 3 degrees of freedom on."""
    share = 2.0 / (9.0 * degrees)
    return degrees * (1.0 - share + NORMAL_QUANTILE[level] * np.sqrt(share)) ** 3
