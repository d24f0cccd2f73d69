"""Recursive least squares with forgetting, and its modified form (thesis 5.3, 5.5.1, figure 5.1).

    E = y - Psi theta,    Lambda += gamma (E E' - Lambda),    1/gamma_t = lambda/gamma_{t-1} + 1
    R += gamma (Psi' Lambda^-1 Psi - R),    theta += gamma R^-1 Psi' Lambda^-1 E

The information S = R / gamma is kept in place of R: the same recursion reads S = lambda S + Psi' Lambda^-1 Psi
and theta += S^-1 Psi' Lambda^-1 E. Only parameters that a sample excites are forgotten by it; before contact
nothing would, and forgetting would inflate their covariance without bound.

MRLS: where the moving mean of E over m samples leaves its limit, the index goes back by m and those samples
are used again with the correction multiplied by cr, each step clipped to theta_lmt; theta, R and Lambda carry
on. This is repeated until the mean is within its limit, or `rewinds` times. Figure 5.1 has no guard against a
correction that overshoots; here a pass that leaves a larger mean than it found is taken back and ends the rewinding.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..estimate import Event
from ..regression import Regression
from .update import Theta, Update, within_bounds

NOISE_FLOOR = 0.1
"""Share of the known noise variance below which Lambda must not fall: it is the mean of few E E', so nearly singular."""


class RlsState(NamedTuple):
    theta: np.ndarray  # (p,)
    information: np.ndarray  # (p, p) S = R / gamma
    spread: np.ndarray  # (p, p) the same sum with squared weights: covariance = S^-1 spread S^-1
    error_covariance: np.ndarray  # (q, q) Lambda
    gamma: float
    residual_variance: np.ndarray  # (q,) slow mean of the squared residual, for the error limits
    window: tuple[Regression, ...]  # the last m regressions (MRLS)
    errors: tuple[np.ndarray, ...]  # and their errors


@dataclass(frozen=True)
class Rls:
    """Settings of RLS and, with m > 0, of MRLS."""

    settings: Theta
    forgetting: float | None = None  # lambda per sample; None: exp(-dt / memory)
    memory: float = 0.005  # s
    m: int = 0  # samples in the moving mean; 0: plain RLS
    cr: float = 3.0  # multiplies the correction after a rewind
    step_limit: float = 0.05  # theta_lmt as a share of each parameter's scale
    error_limit: float = 2.58  # times the error's standard deviation over sqrt(m): 99 %
    rewinds: int = 10

    def init(self, equations: int) -> RlsState:
        std = np.where(self.settings.std > 0, self.settings.std, 1.0)
        information = np.diag(1.0 / std**2)
        unknown = np.full((equations, equations), np.nan)
        return RlsState(
            self.settings.initial, information, information, unknown, 1.0, np.full(equations, np.nan), (), ()
        )

    def update(self, state: RlsState, regression: Regression) -> tuple[RlsState, Update]:
        state = self._started(state, regression)
        innovation_covariance = self._innovation_covariance(state, regression)
        state, error, clamped = self._correct(state, regression, 1.0)
        events: tuple[Event, ...] = ()
        if self.m:
            window, errors = (*state.window, regression)[-self.m :], (*state.errors, error)[-self.m :]
            state, clamped, events = self._rewind(state._replace(window=window, errors=errors), clamped)
        state = self._learn_residual(state, regression)
        return state, Update(state.theta, self._covariance(state), innovation_covariance, clamped, events)

    def _started(self, state: RlsState, regression: Regression) -> RlsState:
        """Lambda starts from the noise known before the impact."""
        if not np.isnan(state.residual_variance).any():
            return state
        noise = np.nan_to_num(regression.noise, nan=1.0)
        return state._replace(error_covariance=np.diag(noise), residual_variance=noise)

    def _correct(
        self, state: RlsState, regression: Regression, multiplier: float
    ) -> tuple[RlsState, np.ndarray, np.ndarray]:
        """One step of the recursion -> the new state, (q,) its error (NaN where not measured), (p,) clamped."""
        forgetting = self.forgetting if self.forgetting is not None else float(np.exp(-regression.dt / self.memory))
        gamma = 1.0 / (forgetting / state.gamma + 1.0)
        target = regression.measured - regression.known
        error = target - regression.gradient @ state.theta
        known_error = np.nan_to_num(error)
        error_covariance = state.error_covariance + gamma * (np.outer(known_error, known_error) - state.error_covariance)
        valid = ~np.isnan(error)
        weight = np.zeros_like(error_covariance)
        floor = NOISE_FLOOR * np.diag(np.nan_to_num(regression.noise, nan=0.0))
        weight[np.ix_(valid, valid)] = np.linalg.inv((error_covariance + floor)[np.ix_(valid, valid)])
        excited = regression.active & (regression.gradient[valid] != 0.0).any(axis=0)
        fade = np.where(excited, np.sqrt(forgetting), 1.0)
        gained = regression.gradient.T @ weight @ regression.gradient
        information = fade[:, None] * state.information * fade + gained
        spread = fade[:, None] ** 2 * state.spread * fade**2 + gained

        def solve(theta: np.ndarray, active: np.ndarray) -> np.ndarray:
            index = np.flatnonzero(active)
            residual = np.nan_to_num(target - regression.gradient @ theta)
            pull = (regression.gradient.T @ weight @ residual)[index]
            step = multiplier * np.linalg.solve(information[np.ix_(index, index)], pull)
            if multiplier != 1.0:
                limit = self.step_limit * self.settings.scale[index]
                step = np.clip(step, -limit, limit)
            updated = theta.copy()
            updated[index] += step
            return updated

        theta, clamped = within_bounds(solve, state.theta, excited, self.settings)
        state = state._replace(
            theta=theta, information=information, spread=spread, error_covariance=error_covariance, gamma=gamma
        )
        return state, error, clamped

    def _rewind(self, state: RlsState, clamped: np.ndarray) -> tuple[RlsState, np.ndarray, tuple[Event, ...]]:
        if len(state.window) < self.m:
            return state, clamped, ()
        limit = self.error_limit * np.sqrt(state.residual_variance / self.m)
        passes, excess = 0, self._excess(state.errors, limit)
        while passes < self.rewinds and excess > 1.0:
            again, errors, held = state, [], clamped
            for regression in state.window:
                again, error, held = self._correct(again, regression, self.cr)
                errors.append(error)
            now = self._excess(tuple(errors), limit)
            if now >= excess:  # the large correction has overshot: it is taken back
                break
            state, clamped, excess, passes = again._replace(errors=tuple(errors)), held, now, passes + 1
        if not passes:
            return state, clamped, ()
        steps = passes * self.m
        return state, clamped, (Event("rewound", "samples", float(steps), f"rewound {passes} x {self.m} samples"),)

    @staticmethod
    def _excess(errors: tuple[np.ndarray, ...], limit: np.ndarray) -> float:
        """The largest moving mean of the error over its limit; above 1 the parameters are taken to have changed."""
        return float(np.max(np.abs(np.mean(np.nan_to_num(errors), axis=0)) / limit))

    def _learn_residual(self, state: RlsState, regression: Regression) -> RlsState:
        residual = regression.measured - regression.known - regression.gradient @ state.theta
        share = regression.dt / (regression.dt + 4.0 * self.memory)
        squared = np.where(np.isnan(residual), state.residual_variance, residual**2)
        variance = state.residual_variance + share * (squared - state.residual_variance)
        return state._replace(residual_variance=np.fmax(variance, regression.noise))

    def _covariance(self, state: RlsState) -> np.ndarray:
        inverse = np.linalg.inv(state.information)
        known = self.settings.std == 0.0
        covariance = inverse @ state.spread @ inverse
        covariance[known, :] = covariance[:, known] = 0.0
        return 0.5 * (covariance + covariance.T)

    def _innovation_covariance(self, state: RlsState, regression: Regression) -> np.ndarray:
        return np.diag(state.residual_variance) + regression.gradient @ self._covariance(state) @ regression.gradient.T
