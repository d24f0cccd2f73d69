"""Kalman filter of the parameters as a random walk, constrained by physics (thesis 6.3, 6.4.2, figure 6.6).

    theta_t = theta_{t-1} + w,  w ~ (0, R1)          y_t = Psi_t theta_t + e,  e ~ (0, R2)
    L = P Psi' (R2 + Psi P Psi')^-1,   theta += L (y - Psi theta),   P = (I - L Psi) P (I - L Psi)' + L R2 L'

The process noise R1 follows the crush, because stiffness is a function of crush: the variance grows by
(drift theta)^2 for each e-fold of crush, and not at all while nothing moves. R2 starts from the noise
before the impact (or the model's `noise`) and adapts:  E[residual innovation] = R2  holds for any gain that
is optimal, so its running mean over `noise_memory` estimates what the model cannot follow as well.

Crush is integrated twice from accelerations whose zero is known no better than the mean of n noisy samples, so
that a stiff element's force is wrong by K b t^2 / 2. With `offsets` these errors b, one for each measured body, are
estimated with theta, from 0 and within what the pre-impact noise lets them be:

    y = Psi theta + H b + e,    b ~ (0, noise / n)

Without them a stiffness bends to explain b, and its sigma is too small; to consider b (Schmidt) and leave it unestimated
keeps the sigma right, but leaves K b t^2 / 2 in the residual.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..regression import Regression
from .update import Theta, Update, within_bounds

SMALLEST_SHARE = 0.05
"""Of a parameter's scale: a stiffness clamped to zero must be able to leave it again."""


class KalmanState(NamedTuple):
    theta: np.ndarray  # (p,)
    covariance: np.ndarray  # (p, p), or (p + b, p + b) once the offsets' errors have joined
    offsets: np.ndarray  # (b,) m/s^2, the zero offsets' errors; empty until they have joined
    noise: np.ndarray  # (q,) variance of each equation's error, R2; NaN until the first update


@dataclass(frozen=True)
class Kalman:
    """Settings of the filter."""

    settings: Theta
    constrained: bool = True  # keep the parameters' bounds
    noise_memory: float = 0.005  # s over which R2 adapts; 0 keeps the noise known before the impact
    offsets: bool = True  # estimate the errors of the zero offsets with theta

    def init(self, equations: int) -> KalmanState:
        return KalmanState(
            self.settings.initial, np.diag(self.settings.std**2), np.zeros(0), np.full(equations, np.nan)
        )

    def update(self, state: KalmanState, regression: Regression) -> tuple[KalmanState, Update]:
        theta, noise, p = state.theta, self._noise(state, regression), len(state.theta)
        covariance, gradient, offsets = state.covariance, regression.gradient, state.offsets
        if self.offsets:
            if len(covariance) == p:
                covariance = _with_offsets(covariance, regression.offset_variance)
                offsets = np.zeros(len(covariance) - p)
            gradient = np.hstack([gradient, regression.offset_gradient])
        always = np.ones(len(offsets), dtype=bool)
        prior = covariance + np.diag(self._walk(theta, regression, len(offsets)))
        target = regression.measured - regression.known
        equations = [(psi, y, r) for psi, y, r in zip(gradient, target, noise) if not np.isnan(y)]

        def assimilate(theta: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            """The equations' errors are independent, so they update in turn, each with a scalar to divide by."""
            covariance, both = prior, np.concatenate([theta, offsets])
            moved = np.concatenate([free, always])
            for psi_all, y, r in equations:
                psi = np.where(moved, psi_all, 0.0)
                spread = covariance @ psi
                gain = np.where(moved, spread / (r + psi @ spread), 0.0)
                both = both + gain * (y - psi_all @ both)
                lessen = np.eye(len(prior)) - np.outer(gain, psi)
                covariance = lessen @ covariance @ lessen.T + r * np.outer(gain, gain)
            return both, 0.5 * (covariance + covariance.T)

        bounds = self.settings if self.constrained else self.settings._replace(lower=-np.inf, upper=np.inf)
        updated, clamped = within_bounds(lambda t, free: assimilate(t, free)[0][:p], theta, regression.active, bounds)
        held = np.where(clamped, updated, theta)
        both, covariance = assimilate(held, regression.active & ~clamped)
        innovation_covariance = np.diag(noise) + gradient @ prior @ gradient.T
        expected, expected_after = gradient[:, p:] @ offsets, gradient[:, p:] @ both[p:]
        residual = target - regression.gradient @ updated - expected_after
        products = residual * (target - regression.gradient @ theta - expected)
        state = KalmanState(updated, covariance, both[p:], self._adapt(noise, products, regression))
        return state, Update(
            updated, covariance[:p, :p], innovation_covariance, clamped, expected_error=(expected, expected_after)
        )

    def _walk(self, theta: np.ndarray, regression: Regression, extra: int) -> np.ndarray:
        size = np.maximum(np.abs(theta), SMALLEST_SHARE * self.settings.scale)
        return np.concatenate([regression.walk * size**2, np.zeros(extra)])

    def _noise(self, state: KalmanState, regression: Regression) -> np.ndarray:
        return np.where(np.isnan(state.noise), np.nan_to_num(regression.noise, nan=1.0), state.noise)

    def _adapt(self, noise: np.ndarray, products: np.ndarray, regression: Regression) -> np.ndarray:
        if not self.noise_memory:
            return noise
        share = regression.dt / (regression.dt + self.noise_memory)
        adapted = noise + share * (np.where(np.isnan(products), noise, np.maximum(products, 0.0)) - noise)
        return np.fmax(adapted, regression.noise)


def _with_offsets(covariance: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """Append the offsets' errors (b,), each with the variance learnt before the impact."""
    p = len(covariance)
    grown = np.diag(np.concatenate([np.zeros(p), variance]))
    grown[:p, :p] = covariance
    return grown
