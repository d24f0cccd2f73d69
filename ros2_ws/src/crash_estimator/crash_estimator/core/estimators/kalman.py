"""Kalman filter of the parameters as a random walk, constrained by physics (thesis 6.3, 6.4.2, figure 6.6).

    theta_t = theta_{t-1} + w,  w ~ (0, R1)          y_t = Psi_t theta_t + e,  e ~ (0, R2)
    L = P Psi' (R2 + Psi P Psi')^-1,   theta += L (y - Psi theta),   P = (I - L Psi) P (I - L Psi)' + L R2 L'

P is kept as a root, P = S S', which stays positive whatever is rounded (Potter 1963; Bierman 1977, chapter V): a sum of
products is that of columns beside one another, and turned into as few columns as rows by an orthogonal transformation,

    P + diag(q) = [S, diag(q)^1/2] [..]'         (I - L Psi) P (I - L Psi)' + L R2 L' = [(I - L Psi) S, L R2^1/2] [..]'

The process noise R1 follows the crush, because stiffness is a function of crush: the variance grows by
(drift theta)^2 for each e-fold of crush, and not at all while nothing moves. R2 starts from the noise
before the impact (or the model's `noise`) and adapts:  E[residual innovation] = R2  holds for any gain that
is optimal, so its running mean over `noise_memory` estimates what the model cannot follow as well. It does not fall
below the noise before the impact, or where that is not known below QUIETEST: a stiffness that drifts as fast as the
samples come follows each of them exactly, and then R2 would shrink to the rounding of the measurement.

With `process_noise` R1 is instead what the thesis prints, a constant that is added after the update:
P_t = (I - L Psi) P_{t-1} + R1, R1 = diag(process_noise scale)^2 dt. `THESIS` is the filter of 6.3 as printed, with R2
constant too and the integrated motion taken as true; `constrained` adds 6.4.2. The thesis gives no R1.

Crush is integrated twice from accelerations whose zero is known no better than the mean of n noisy samples, so
that a stiff element's force is wrong by K b t^2 / 2. With `offsets` these errors b, one for each measured body, are
estimated with theta, from 0 and within what the pre-impact noise lets them be:

    y = Psi theta + H b + e,    b ~ (0, noise / n)

Without them a stiffness bends to explain b, and its sigma is too small; to consider b (Schmidt) and leave it
unestimated keeps the sigma right, but leaves K b t^2 / 2 in the residual.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..regression import QUIETEST, Regression
from ..regressor_errors import SMALLEST_SHARE, Consequence, none_yet
from .update import Theta, Update, residual_variance, within_bounds

THESIS = {"process_noise": 3.0, "noise_memory": 0.0, "offsets": False, "regressor_errors": False}
"""Settings of 6.3 as printed. R1, in scales per square root of a second, is ours: of 1, 3, 10 and 30 the one with the
smallest force errors on the simulated recordings (`thesis.printed`)."""


class KalmanState(NamedTuple):
    theta: np.ndarray  # (p,)
    root: np.ndarray  # (p, p) of the covariance, or (p + b, p + b) once the offsets' errors have joined
    offsets: np.ndarray  # (b,) m/s^2, the zero offsets' errors; empty until they have joined
    noise: np.ndarray  # (q,) variance of each equation's error, R2; NaN until the first update
    beside: Consequence | None = None  # what errors of the motion have made of theta and the offsets, beside P

    @property
    def covariance(self) -> np.ndarray:
        """(p, p) of theta."""
        return covariance_of(self.root[: len(self.theta)])

    def widened(self, variance: np.ndarray) -> "KalmanState":
        """With the variance (p,) of a jump added."""
        return self._replace(root=narrowed(np.hstack([self.root, np.diag(np.sqrt(variance))])))


@dataclass(frozen=True)
class Kalman:
    """Settings of the filter."""

    settings: Theta
    constrained: bool = True  # keep the parameters' bounds
    noise_memory: float = 0.005  # s over which R2 adapts; 0 keeps the noise known before the impact
    offsets: bool = True  # estimate the errors of the zero offsets with theta
    process_noise: float = 0.0  # R1's standard deviation, scales of each parameter per sqrt(s); 0: R1 follows the crush
    regressor_errors: bool = True  # count errors of the integrated motion and the lag; hold what they hide

    @property
    def compilable(self) -> bool:
        """Whether the compiled form has these settings."""
        return self.regressor_errors and not self.process_noise

    def init(self, equations: int) -> KalmanState:
        return KalmanState(self.settings.initial, np.diag(self.settings.std), np.zeros(0), np.full(equations, np.nan))

    def update(self, state: KalmanState, regression: Regression) -> tuple[KalmanState, Update]:
        theta, noise, p = state.theta, self._noise(state, regression), len(state.theta)
        root, gradient, offsets = state.root, regression.gradient, state.offsets
        if self.offsets:
            if len(root) == p:
                root = _with_offsets(root, regression.offset_variance)
                offsets = np.zeros(len(root) - p)
            gradient = np.hstack([gradient, regression.offset_gradient])
        always = np.ones(len(offsets), dtype=bool)
        prior = np.hstack([root, self._walk(theta, regression, len(offsets))])
        target = regression.measured - regression.known
        equations = [(psi, y, r) for psi, y, r in zip(gradient, target, noise) if not np.isnan(y)]

        gains: list[np.ndarray] = []

        def assimilate(theta: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            """The equations' errors are independent, so they update in turn, each with a scalar to divide by."""
            root, both = prior, np.concatenate([theta, offsets])
            gains.clear()
            moved = np.concatenate([free, always])
            counted = np.concatenate([free | ~regression.active, always])  # all but those held at a bound
            for psi_all, y, r in equations:
                seen = np.where(counted, psi_all, 0.0) @ root  # psi S
                gain = np.where(moved, root @ seen / (r + seen @ seen), 0.0)
                both = both + gain * (y - psi_all @ both)
                root = np.column_stack([root - np.outer(gain, seen), gain * np.sqrt(r)])
                gains.append(gain)
            return both, root

        bounds = self.settings if self.constrained else _unbounded(self.settings)
        updated, clamped = within_bounds(lambda t, free: assimilate(t, free)[0][:p], theta, regression.active, bounds)
        held = np.where(clamped, updated, theta)
        both, root = assimilate(held, regression.active & ~clamped)
        innovation_covariance = np.diag(noise) + covariance_of(gradient @ prior)
        expected, expected_after = gradient[:, p:] @ offsets, gradient[:, p:] @ both[p:]
        residual = target - regression.gradient @ updated - expected_after
        products = residual * (target - regression.gradient @ theta - expected)
        # one at its bound counts as known, as it does in P
        seen = np.where(np.concatenate([~clamped, always]), gradient, 0.0)
        beside = self._beside(state, regression, seen, gains)
        left = residual_variance(noise, gradient, covariance_of(root), _influence(gradient, target, gains))
        root = np.hstack([root, self._constant_walk(regression, len(root))])
        state = KalmanState(updated, narrowed(root), both[p:], self._adapt(noise, products, regression), beside)
        return state, Update(
            updated, state.covariance, innovation_covariance, clamped, expected_error=(expected, expected_after),
            all_told=state.covariance + beside.covariance[:p, :p], residual_variance=left,
        )  # fmt: skip

    def _beside(
        self, state: KalmanState, regression: Regression, gradient: np.ndarray, gains: list[np.ndarray]
    ) -> Consequence:
        """Errors of the motion, equation by equation as they were assimilated; those that are estimated are in P."""
        errors = regression.errors
        beside = state.beside or self._at_first(regression, gradient.shape[1])
        if errors is None:
            return beside
        if self.offsets:
            errors = errors._replace(zero=np.where(regression.offset_variance > 0.0, 0.0, errors.zero))
        measured = np.flatnonzero(~np.isnan(regression.measured))
        for row, gain in zip(measured, gains, strict=True):
            one = errors._replace(gradient=errors.gradient[row : row + 1])
            beside = beside.after(gain[:, None], gradient[row : row + 1], one)
        return beside

    def _at_first(self, regression: Regression, count: int) -> Consequence:
        """P starts from zeros that are wrong by their own error and by the noise's mean; that is followed here."""
        beside = none_yet(count, 0 if regression.errors is None else len(regression.errors.zero))
        if self.offsets and regression.errors is not None:
            surplus = np.where(
                regression.offset_variance > 0.0, regression.errors.zero - regression.offset_variance, 0.0
            )
            p = count - len(surplus)
            return beside.walked(np.concatenate([np.zeros(p), surplus]))
        return beside

    def _walk(self, theta: np.ndarray, regression: Regression, extra: int) -> np.ndarray:
        """Root of R1 that follows the crush: a column for each parameter that walks."""
        if self.process_noise:
            return np.zeros((len(theta) + extra, 0))
        size = np.maximum(np.abs(theta), SMALLEST_SHARE * self.settings.scale)
        std = np.concatenate([np.sqrt(regression.walk) * size, np.zeros(extra)])
        return np.diag(std)[:, std > 0.0]

    def _constant_walk(self, regression: Regression, rows: int) -> np.ndarray:
        """Root of the constant R1: a column for each parameter that is estimated at this sample."""
        std = self.process_noise * np.sqrt(regression.dt) * self.settings.scale
        walks = np.flatnonzero(regression.active & (std > 0.0))
        root = np.zeros((rows, len(walks)))
        root[walks, np.arange(len(walks))] = std[walks]
        return root

    def _noise(self, state: KalmanState, regression: Regression) -> np.ndarray:
        return np.where(np.isnan(state.noise), np.nan_to_num(regression.noise, nan=1.0), state.noise)

    def _adapt(self, noise: np.ndarray, products: np.ndarray, regression: Regression) -> np.ndarray:
        if not self.noise_memory:
            return noise
        share = regression.dt / (regression.dt + self.noise_memory)
        adapted = noise + share * (np.where(np.isnan(products), noise, np.maximum(products, 0.0)) - noise)
        return np.maximum(adapted, np.nan_to_num(regression.noise, nan=QUIETEST**2))


def _influence(gradient: np.ndarray, target: np.ndarray, gains: list[np.ndarray]) -> np.ndarray:
    """(n, q) Of each equation's noise on the error after all updates; gains (n,) of the measured ones in their turn."""
    influence = np.zeros(gradient.shape[::-1])
    for row, gain in zip(np.flatnonzero(~np.isnan(target)), gains, strict=True):
        influence -= np.outer(gain, gradient[row] @ influence)
        influence[:, row] += gain
    return influence


def _with_offsets(root: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """Append the offsets' errors (b,), each with the variance learnt before the impact."""
    p = len(root)
    grown = np.diag(np.concatenate([np.zeros(p), np.sqrt(variance)]))
    grown[:p, :p] = root
    return grown


def _unbounded(settings: Theta) -> Theta:
    return settings._replace(lower=np.full_like(settings.lower, -np.inf), upper=np.full_like(settings.upper, np.inf))


def covariance_of(root: np.ndarray) -> np.ndarray:
    """S (p, n) -> S S' (p, p)."""
    covariance = root @ root.T
    return 0.5 * (covariance + covariance.T)


def narrowed(root: np.ndarray) -> np.ndarray:
    """S (p, n) -> a triangular root (p, p) of the same S S', n >= p."""
    return np.asarray(np.linalg.qr(root.T, mode="r")).T
