"""Kalman filter of the parameters as a random walk, constrained by physics (thesis 6.3, 6.4.2, figure 6.6).

    theta_t = theta_{t-1} + w,  w ~ (0, R1)          y_t = Psi_t theta_t + e,  e ~ (0, R2)
    L = P Psi' (R2 + Psi P Psi')^-1,   theta += L (y - Psi theta),   P = (I - L Psi) P (I - L Psi)' + L R2 L'

The process noise R1 follows the crush, because stiffness is a function of crush: the variance grows by
(drift theta)^2 for each e-fold of crush, and not at all while nothing moves. R2 starts from the noise
before the impact (or the model's `noise`) and adapts:  E[residual innovation] = R2  holds for any gain that
is optimal, so its running mean over `noise_memory` estimates what the model cannot follow as well.
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
    covariance: np.ndarray  # (p, p)
    noise: np.ndarray  # (q,) variance of each equation's error, R2; NaN until the first update


@dataclass(frozen=True)
class Kalman:
    """Settings of the filter."""

    settings: Theta
    constrained: bool = True  # keep the parameters' bounds
    noise_memory: float = 0.005  # s over which R2 adapts; 0 keeps the noise known before the impact

    def init(self, equations: int) -> KalmanState:
        return KalmanState(self.settings.initial, np.diag(self.settings.std**2), np.full(equations, np.nan))

    def update(self, state: KalmanState, regression: Regression) -> tuple[KalmanState, Update]:
        theta, noise = state.theta, self._noise(state, regression)
        size = np.maximum(np.abs(theta), SMALLEST_SHARE * self.settings.scale)
        prior = state.covariance + np.diag(regression.walk * size**2)
        valid = ~np.isnan(regression.measured)
        gradient, target = regression.gradient[valid], (regression.measured - regression.known)[valid]
        r2 = np.diag(noise[valid])

        def gain(active: np.ndarray) -> np.ndarray:
            psi = np.where(active, gradient, 0.0)
            spread = prior @ psi.T
            return np.where(active[:, None], np.linalg.solve(r2 + psi @ spread, spread.T).T, 0.0)

        def solve(theta: np.ndarray, active: np.ndarray) -> np.ndarray:
            return theta + gain(active) @ (target - gradient @ theta)

        if self.constrained:
            updated, clamped = within_bounds(solve, theta, regression.active, self.settings)
        else:
            updated, clamped = solve(theta, regression.active), np.zeros(len(theta), dtype=bool)
        lessen = np.eye(len(theta)) - gain(regression.active & ~clamped) @ gradient
        keep = gain(regression.active & ~clamped)
        covariance = lessen @ prior @ lessen.T + keep @ r2 @ keep.T
        covariance = 0.5 * (covariance + covariance.T)
        innovation_covariance = np.diag(noise) + regression.gradient @ prior @ regression.gradient.T
        products = (regression.measured - regression.known - regression.gradient @ updated) * (
            regression.measured - regression.known - regression.gradient @ theta
        )
        state = KalmanState(updated, covariance, self._adapt(noise, products, regression))
        return state, Update(updated, covariance, innovation_covariance, clamped)

    def _noise(self, state: KalmanState, regression: Regression) -> np.ndarray:
        return np.where(np.isnan(state.noise), np.nan_to_num(regression.noise, nan=1.0), state.noise)

    def _adapt(self, noise: np.ndarray, products: np.ndarray, regression: Regression) -> np.ndarray:
        if not self.noise_memory:
            return noise
        share = regression.dt / (regression.dt + self.noise_memory)
        adapted = noise + share * (np.where(np.isnan(products), noise, np.maximum(products, 0.0)) - noise)
        return np.fmax(adapted, regression.noise)
