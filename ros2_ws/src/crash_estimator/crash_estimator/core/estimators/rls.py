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

What the thesis does not print is a setting: `THESIS` and `THESIS_MRLS` are the recursions as printed. There all of R is
forgotten by every sample, Lambda has no floor, no bound holds theta, the error limit is that of the noise known before,
theta_lmt holds for every step, samples are used again until the mean is within its limit or `rewinds` times, also where
that overshoots, and the integrated motion is taken as true. Figure 5.1 is not in the thesis's text: the index is taken
to go back after the step of sample t.

Covariance of theta: each step is linear, theta += G (y - Psi theta) with whatever gain G was used, so that the errors v
of the measurements, of variance r, pass through it as

    error of theta <- (I - G Psi) error + G v

A sample that is used again brings the same v again, not a new one. So the part B_i of each sample of the window in the
error, error = carried + sum B_i v_i, is kept until the sample leaves the window:

    B_j <- (I - G Psi) B_j for all j,    B_i += G for the sample used,    covariance = cov(carried) + sum B_i r B_i'
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..estimate import Event
from ..regression import Regression
from ..regressor_errors import Consequence, none_yet
from .lag import Walking, followed, with_lag
from .update import Theta, Update, residual_variance, within_bounds

NOISE_FLOOR = 0.1
"""Share of the known noise variance below which Lambda must not fall: it is the mean of few E E': nearly singular."""

THESIS = {"noise_floor": 0.0, "forget_excited": False, "constrained": False, "regressor_errors": False}
"""Settings of 5.3 as printed."""
THESIS_MRLS = THESIS | {"learn_limit": False, "limit_every_step": True, "take_back": False}
"""Settings of 5.5.1 as printed, but for `rewinds`: where the mean does not come within its limit, as with a `cr` that
overshoots, the printed rewinding never ends."""


class RlsState(NamedTuple):
    theta: np.ndarray  # (p,)
    information: np.ndarray  # (p, p) S = R / gamma
    carried: np.ndarray  # (p, p) covariance of theta's error from all that was before the window
    error_covariance: np.ndarray  # (q, q) Lambda
    gamma: float
    residual_variance: np.ndarray  # (q,) r: slow mean of error before times error after the step
    window: tuple[Regression, ...]  # the last m regressions (MRLS)
    errors: tuple[np.ndarray, ...]  # and their errors
    influence: tuple[np.ndarray, ...]  # B_i of each, (p, q)
    variances: tuple[np.ndarray, ...]  # r_i of each, (q,)
    beside: Consequence | None = None  # what the errors of the motion have made of theta, where no filter counts it
    lag: Walking = None  # the filter beside it


class Step(NamedTuple):
    """What one correction did."""

    gain: np.ndarray  # (p, q)
    error: np.ndarray  # (q,) before it; NaN where not measured
    clamped: np.ndarray  # (p,)


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
    noise_floor: float = NOISE_FLOOR  # share of the known noise variance that is added to Lambda
    forget_excited: bool = True  # a sample forgets only what it excites; else all of R
    constrained: bool = True  # keep the parameters' bounds
    learn_limit: bool = True  # the error's standard deviation is learnt; else that of the noise known before
    limit_every_step: bool = False  # theta_lmt also on steps that are not repeated
    take_back: bool = True  # a pass that leaves a larger mean than it found is taken back
    regressor_errors: bool = True  # count errors of the integrated motion and the lag; hold what they hide

    @property
    def compilable(self) -> bool:
        """Whether the compiled form has these settings: it has the default of each addition to the thesis."""
        learns = self.learn_limit and self.take_back and not self.limit_every_step
        return self.forget_excited and self.constrained and self.regressor_errors and learns

    def init(self, equations: int) -> RlsState:
        std = np.where(self.settings.std > 0, self.settings.std, 1.0)
        unknown = np.full((equations, equations), np.nan)
        return RlsState(
            self.settings.initial, np.diag(1.0 / std**2), np.diag(self.settings.std**2),
            unknown, 1.0, np.full(equations, np.nan), (), (), (), (),
        )  # fmt: skip

    def update(
        self, state: RlsState, regression: Regression, trust: np.ndarray | float = 1.0
    ) -> tuple[RlsState, Update]:
        """trust: (q,) share of its information that an equation is counted with; its noise counts as so much larger."""
        state = self._started(state, regression)
        innovation_covariance = self._innovation_covariance(state, regression)
        state = state._replace(lag=followed(self.settings, state.lag, regression))
        state, step = self._correct(state, regression, 1.0, trust)
        state = self._remember(state, regression, step, state.residual_variance / trust)
        state, clamped, events = self._rewind(state, step.clamped)
        covariance = self._covariance(state)
        influence = state.influence[-1] if self.m else step.gain
        left = residual_variance(state.residual_variance, regression.gradient, covariance, influence)
        state = self._learn_residual(state, regression, step.error)
        all_told = with_lag(covariance + state.beside.covariance, state.theta, state.lag)
        return state, Update(
            state.theta, covariance, innovation_covariance, clamped, events, all_told=all_told, residual_variance=left
        )

    def _started(self, state: RlsState, regression: Regression) -> RlsState:
        """Lambda starts from the noise known before the impact."""
        if state.beside is None:
            bodies = 0 if regression.errors is None else len(regression.errors.zero)
            state = state._replace(beside=none_yet(len(state.theta), bodies))
        if not np.isnan(state.residual_variance).any():
            return state
        noise = np.nan_to_num(regression.noise, nan=1.0)
        return state._replace(error_covariance=np.diag(noise), residual_variance=noise)

    def _correct(
        self, state: RlsState, regression: Regression, multiplier: float, trust: np.ndarray | float = 1.0
    ) -> tuple[RlsState, Step]:
        """One step of the recursion; the influence of the sample itself is left to the caller."""
        forgetting = self.forgetting if self.forgetting is not None else float(np.exp(-regression.dt / self.memory))
        gamma = 1.0 / (forgetting / state.gamma + 1.0)
        target = regression.measured - regression.known
        error = target - regression.gradient @ state.theta
        known_error = np.nan_to_num(error)
        error_covariance = state.error_covariance + gamma * (
            np.outer(known_error, known_error) - state.error_covariance
        )
        valid = ~np.isnan(error)
        weight = np.zeros_like(error_covariance)
        floor = self.noise_floor * np.diag(np.nan_to_num(regression.noise, nan=0.0))
        weight[np.ix_(valid, valid)] = np.linalg.inv((error_covariance + floor)[np.ix_(valid, valid)])
        weight *= np.sqrt(np.multiply.outer(trust * np.ones(len(weight)), trust * np.ones(len(weight))))
        excited = regression.active & ((regression.gradient[valid] != 0.0).any(axis=0) | (not self.forget_excited))
        fade = np.where(excited | (not self.forget_excited), np.sqrt(forgetting), 1.0)
        of_active = np.where(excited, regression.gradient, 0.0)
        gained = of_active.T @ weight @ of_active
        information = fade[:, None] * state.information * fade + gained
        gain = np.zeros(regression.gradient.shape[::-1])

        def solve(theta: np.ndarray, active: np.ndarray) -> np.ndarray:
            index = np.flatnonzero(active)
            residual = np.nan_to_num(target - regression.gradient @ theta)
            pull = (regression.gradient.T @ weight)[index]
            both = multiplier * np.linalg.solve(
                information[np.ix_(index, index)], np.column_stack([pull @ residual, pull])
            )
            step, gain[:], gain[index] = both[:, 0], 0.0, both[:, 1:]
            if multiplier != 1.0 or self.limit_every_step:
                limit = self.step_limit * self.settings.scale[index]
                gain[index] *= np.minimum(1.0, limit / np.maximum(np.abs(step), 1e-300))[:, None]
                step = np.clip(step, -limit, limit)
            updated = theta.copy()
            updated[index] += step
            return updated

        none = np.full(len(state.theta), np.inf)
        bounds = self.settings if self.constrained else self.settings._replace(lower=-none, upper=none)
        theta, clamped = within_bounds(solve, state.theta, excited, bounds)
        lessen = np.eye(len(theta)) - gain @ regression.gradient
        state = state._replace(
            theta=theta,
            information=information,
            error_covariance=error_covariance,
            gamma=gamma,
            carried=lessen @ state.carried @ lessen.T,
            influence=tuple(lessen @ part for part in state.influence),
            beside=state.beside if state.lag else state.beside.after(gain, regression.gradient, regression.errors),
        )
        return state, Step(gain, error, clamped)

    def _remember(self, state: RlsState, regression: Regression, step: Step, variance: np.ndarray) -> RlsState:
        """The sample joins the window; what leaves it will not be used again, its errors are carried on."""
        state = state._replace(
            window=(*state.window, regression),
            errors=(*state.errors, step.error),
            influence=(*state.influence, step.gain),
            variances=(*state.variances, variance),
        )
        if len(state.window) <= self.m:
            return state
        old = state.influence[0]
        return state._replace(
            carried=state.carried + old * state.variances[0] @ old.T,
            window=state.window[1:],
            errors=state.errors[1:],
            influence=state.influence[1:],
            variances=state.variances[1:],
        )

    def _rewind(self, state: RlsState, clamped: np.ndarray) -> tuple[RlsState, np.ndarray, tuple[Event, ...]]:
        if not self.m or len(state.window) < self.m:
            return state, clamped, ()
        known = np.nan_to_num(state.window[-1].noise, nan=1.0)
        limit = self.error_limit * np.sqrt((state.residual_variance if self.learn_limit else known) / self.m)
        passes, excess = 0, self._excess(state.errors, limit)
        while passes < self.rewinds and excess > 1.0:
            again, errors, held = state, [], clamped
            for k, regression in enumerate(state.window):
                again, step = self._correct(again, regression._replace(errors=state.window[-1].errors), self.cr)
                influence = list(again.influence)
                influence[k] = influence[k] + step.gain
                again, held = again._replace(influence=tuple(influence)), step.clamped
                errors.append(step.error)
            now = self._excess(tuple(errors), limit)
            if self.take_back and now >= excess:  # the large correction has overshot: it is taken back
                break
            chosen = self._chosen_variance(state)
            variances = tuple(np.maximum(variance, chosen) for variance in state.variances)
            state = again._replace(errors=tuple(errors), variances=variances)
            clamped, excess, passes = held, now, passes + 1
        if not passes:
            return state, clamped, ()
        steps = passes * self.m
        return state, clamped, (Event("rewound", "samples", float(steps), f"rewound {passes} x {self.m} samples"),)

    @staticmethod
    def _excess(errors: tuple[np.ndarray, ...], limit: np.ndarray) -> float:
        """The largest moving mean of the error over its limit; above 1 the parameters are taken to have changed."""
        return float(np.max(np.abs(np.mean(np.nan_to_num(errors), axis=0)) / limit))

    def _chosen_variance(self, state: RlsState) -> np.ndarray:
        """(q,) m E[(mean v)^2 | mean error], v and theta's error being normal with what is known of them so far."""
        error = np.mean(np.nan_to_num(state.errors), axis=0)
        gradient = np.mean([regression.gradient for regression in state.window], axis=0)
        spread = np.einsum("qp,pr,qr->q", gradient, self._covariance(state), gradient)
        share = state.residual_variance / (state.residual_variance + self.m * spread)
        return self.m * (share * error) ** 2 + (1.0 - share) * state.residual_variance

    def _learn_residual(self, state: RlsState, regression: Regression, error: np.ndarray) -> RlsState:
        """E[error before times error after] = r, as the gain is about optimal; either's square is more, or less."""
        residual = regression.measured - regression.known - regression.gradient @ state.theta
        share = regression.dt / (regression.dt + 4.0 * self.memory)
        squared = np.where(np.isnan(residual), state.residual_variance, np.maximum(error * residual, 0.0))
        variance = state.residual_variance + share * (squared - state.residual_variance)
        return state._replace(residual_variance=np.fmax(variance, regression.noise))

    def _covariance(self, state: RlsState) -> np.ndarray:
        covariance = state.carried.copy()
        for part, variance in zip(state.influence, state.variances):
            covariance += part * variance @ part.T
        return 0.5 * (covariance + covariance.T)

    def _innovation_covariance(self, state: RlsState, regression: Regression) -> np.ndarray:
        return np.diag(state.residual_variance) + regression.gradient @ self._covariance(state) @ regression.gradient.T
