"""Recursive Gauss-Newton with an ARMA(p, q) model of each equation's error (thesis 4.10, 4.12).

    D(B) e_t = A(B) eps_t,    D = 1 + d_1 B + ... + d_p B^p,    A = 1 + a_1 B + ... + a_q B^q
    e_t = y - psi theta,      eps_t = e_t + sum d_i e_{t-i} - sum a_j eps_{t-j}

B delays by one sample, eps is the one-step prediction error, p and q may differ from equation to equation. The
past e are those of the current theta, the past eps those after their update. Then the gradient is exact:

    Psi = -d eps/d theta:  Psi_t = psi_t + sum d_i psi_{t-i} - sum a_j Psi_{t-j}
    for d_i:               Psi_t = -e_{t-i} - sum a_j Psi_{t-j}
    for a_j:               Psi_t = eps_{t-j} - sum a_l Psi_{t-l}

theta, d and a go through the recursion of RLS together, with Psi in place of psi; with p = q = 0 it is RLS. The
roots of D and A are kept within `LARGEST_ROOT`: a stationary error, and a predictor that forgets.

`THESIS` is 4.10 as printed: d and a are estimated from the first sample, are forgotten as theta is, and may be any.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..estimate import Event, standard_deviations
from ..regression import Regression
from ..regressor_errors import MotionErrors
from ..structure import ModelError
from .lag import Walking, followed, of_first, with_lag
from .noise_model import LARGEST_ROOT, NoiseModel, stable
from .rls import NOISE_FLOOR, Rls, RlsState
from .rls import THESIS as THESIS_RLS
from .update import Theta, Update

COEFFICIENT_STD = 1.0
"""Of the coefficients d and a before the first sample; they start from 0, white noise. A slow error has d_1 near -1."""

TRUST = 0.1
"""While theta is far off, its misfit would pass for noise with a root near 1, which then explains the spring for good.
So d and a wait until theta is known. Until then the colour of the noise is unknown, and slow noise tells less of theta
than white noise of its variance: samples count with a share `TRUST` of their information."""

LONGEST = 100
"""Orders above this are a mistake in the settings."""

THESIS = THESIS_RLS | {"noise_memory": 0.0, "known_to": np.inf, "largest_root": np.inf}
"""Settings of 4.10 as printed."""


class Past(NamedTuple):
    """One sample as the noise model remembers it: q equations, p parameters, n with d and a."""

    target: np.ndarray  # (q,) measured minus known, NaN where not measured
    gradient: np.ndarray  # (q, p) psi
    error: np.ndarray  # (q,) eps after the update, 0 where not measured
    filtered: np.ndarray  # (q, n) Psi
    errors: np.ndarray | None = None  # (q, b, 3) of the errors of the motion
    errors_filtered: np.ndarray | None = None  # (q, b, 3) as the noise model passes them on


class GaussNewtonState(NamedTuple):
    rls: RlsState  # of theta, then d and a of each equation in turn
    past: tuple[Past, ...]  # the latest first
    learning: np.ndarray  # (q,) whether the equation's d and a are estimated yet
    lag: Walking = None  # of theta alone


@dataclass(frozen=True)
class GaussNewton:
    """Settings of the method."""

    settings: Theta
    p: int | tuple[int, ...] = 1  # autoregressive order, one for all equations or one each
    q: int | tuple[int, ...] = 2  # moving-average order
    forgetting: float | None = None  # as in RLS
    memory: float = 0.005  # s, as in RLS
    noise_memory: float = 0.1  # s: of d and a, which are those of the whole record; 0: forgotten as theta is
    known_to: float = 0.03  # d and a wait until theta adds less than this share of the noise variance; inf: they do not
    largest_root: float = LARGEST_ROOT  # of D and A, in modulus; inf: any
    noise_floor: float = NOISE_FLOOR  # as in RLS
    forget_excited: bool = True  # as in RLS
    constrained: bool = True  # as in RLS
    regressor_errors: bool = True  # as in RLS
    start: tuple[NoiseModel, ...] = ()  # one for each equation, of an earlier pass or an alike test; (): white

    def __post_init__(self):
        for name in ("p", "q"):
            orders = getattr(self, name)
            for order in orders if isinstance(orders, tuple) else (orders,):
                if isinstance(order, bool) or not isinstance(order, int) or not 0 <= order <= LONGEST:
                    said = f"order {name} of gauss_newton must be a whole number from 0 to {LONGEST}, got {order!r}"
                    raise ModelError(said)
        if not isinstance(self.start, tuple):
            raise ModelError(f"start of gauss_newton is a tuple of noise models, one an equation, got {self.start!r}")

    def orders(self, equations: int) -> list[tuple[int, int]]:
        """(p, q) of each equation."""
        p, q = ((o,) * equations if isinstance(o, int) else o for o in (self.p, self.q))
        if not len(p) == len(q) == equations:
            raise ModelError(f"gauss_newton needs one order for each of {equations} equations, got p {p} and q {q}")
        return list(zip(p, q))

    def extra_names(self, equations: tuple[str, ...]) -> dict[str, str]:
        """Name -> unit of `Update.extra`: the coefficients d ("ar") and a ("ma") of each equation."""
        named = zip(equations, self.orders(len(equations)))
        return {
            f"{name}.{kind}{i + 1}": "1"
            for name, (p, q) in named
            for kind, n in (("ar", p), ("ma", q))
            for i in range(n)
        }

    def init(self, equations: int) -> GaussNewtonState:
        without = [p + q == 0 or np.isinf(self.known_to) for p, q in self.orders(equations)]
        rls = self._rls(equations).init(equations)
        if not self.start:
            return GaussNewtonState(rls, (), np.array(without))
        if [(len(model.d), len(model.a)) for model in self.start] != self.orders(equations):
            raise ModelError(
                f"start of gauss_newton must be one noise model of orders p, q for each of {equations} equations"
            )
        return GaussNewtonState(self._begun(rls), (), np.full(equations, True))

    def _begun(self, rls: RlsState) -> RlsState:
        """With the noise models known before: d, a, their covariance and the variance of eps."""
        theta, information, carried = rls.theta.copy(), rls.information.copy(), rls.carried.copy()
        for (d, a), model in zip(self._slices(len(self.start)), self.start):
            both = slice(d.start, a.stop)
            theta[d], theta[a], carried[both, both] = model.d, model.a, model.covariance
            information[both, both] = np.linalg.inv(model.covariance)
        variance = np.array([model.variance for model in self.start])
        return rls._replace(
            theta=theta, information=information, carried=carried,
            error_covariance=np.diag(variance), residual_variance=variance,
        )  # fmt: skip

    def update(self, state: GaussNewtonState, regression: Regression) -> tuple[GaussNewtonState, Update]:
        equations, parameters = regression.gradient.shape
        expected, filtered = self._predict(state.rls.theta, state.past, regression)
        learning = self._learning(state, regression)
        for (d, a), learns in zip(self._slices(equations), learning):
            filtered[:, d.start : a.stop] *= learns
        theta, n = state.rls.theta[:parameters], filtered.shape[1]
        linear = regression.gradient @ theta - filtered @ state.rls.theta
        wide = regression._replace(
            known=regression.known + linear + expected,
            gradient=filtered,
            active=np.concatenate([regression.active, np.ones(n - parameters, dtype=bool)]),
            errors=self._passed_on(state, regression),
        )
        lag = followed(self.settings, state.lag, of_first(wide, state.rls.theta, parameters))
        trust = np.where(learning, 1.0, TRUST)
        rls, update = self._rls(equations).update(self._remembered(state.rls, regression.dt), wide, trust)
        rls = rls._replace(theta=self._stable(rls.theta, equations))
        expected_after, _ = self._predict(rls.theta, state.past, regression)
        target = regression.measured - regression.known
        error = np.nan_to_num(target - regression.gradient @ rls.theta[:parameters] - expected_after)
        longest = max(max(order) for order in self.orders(equations))
        given, passed = (None if r.errors is None else r.errors.gradient for r in (regression, wide))
        past = (Past(target, regression.gradient, error, filtered, given, passed), *state.past)[:longest]
        begun = learning & ~state.learning & ~np.array([p + q == 0 for p, q in self.orders(equations)])
        update = update._replace(
            events=update.events + tuple(self._begins(int(k), regression.time) for k in np.flatnonzero(begun)),
            all_told=with_lag(update.stated[:parameters, :parameters], rls.theta[:parameters], lag),
            theta=rls.theta[:parameters],
            covariance=update.covariance[:parameters, :parameters],
            clamped=update.clamped[:parameters],
            expected_error=(expected, expected_after),
            extra=tuple(rls.theta[parameters:].tolist()),
            extra_std=tuple(standard_deviations(update.covariance)[parameters:].tolist()),
        )
        return GaussNewtonState(rls, past, learning, lag), update

    def _learning(self, state: GaussNewtonState, regression: Regression) -> np.ndarray:
        """(q,) Whether theta is known well enough for what is left over to be noise.

        It is once a sample that would have told much at the start tells little: its spread Psi P Psi' is then below
        `known_to` of the noise variance, plus twice what the forgetting keeps it at.
        """
        psi, p = regression.gradient, regression.gradient.shape[1]
        noise = np.where(np.isnan(state.rls.residual_variance), regression.noise, state.rls.residual_variance)
        spread = np.einsum("qp,pr,qr->q", psi, state.rls.carried[:p, :p], psi) * TRUST
        limit = self.known_to + np.count_nonzero(regression.active) * (1.0 - self._forgetting(regression.dt))
        told = psi**2 @ self.settings.std**2 > noise
        return state.learning | (told & (spread < limit * noise))

    @staticmethod
    def _begins(equation: int, time: float) -> Event:
        """What one pass is worth: the samples before were weighed as if theirs was not the noise of the model."""
        text = (
            f"noise model of equation {equation + 1}: learnt from {time * 1e3:.1f} ms on; in this pass the samples "
            f"before have counted {TRUST:.0%} (`estimate` goes over a record again until it settles)"
        )
        return Event("orders", f"equation {equation + 1}", TRUST, text)

    def _forgetting(self, dt: float) -> float:
        return self.forgetting if self.forgetting is not None else float(np.exp(-dt / self.memory))

    def _remembered(self, state: RlsState, dt: float) -> RlsState:
        """Information on d and a so much larger that the forgetting of RLS leaves what `noise_memory` leaves."""
        count, p = len(state.theta), len(self.settings.initial)
        if count == p or not self.noise_memory:
            return state
        keep = np.ones(count)
        keep[p:] = np.sqrt(float(np.exp(-dt / self.noise_memory)) / self._forgetting(dt))
        return state._replace(information=keep[:, None] * state.information * keep)

    def noise_models(self, state: GaussNewtonState) -> list[NoiseModel]:
        """The noise model of each equation, as known after the last sample."""
        equations = len(state.rls.residual_variance)
        covariance = self._rls(equations)._covariance(state.rls)
        return [
            NoiseModel(state.rls.theta[d], state.rls.theta[a], covariance[d.start : a.stop, d.start : a.stop], float(v))
            for (d, a), v in zip(self._slices(equations), state.rls.residual_variance)
        ]

    def _predict(
        self, theta: np.ndarray, past: tuple[Past, ...], regression: Regression
    ) -> tuple[np.ndarray, np.ndarray]:
        """(q,) the error that the noise model expects, and (q, n) Psi, both for theta (n,) with its d and a."""
        equations, parameters = regression.gradient.shape
        expected, filtered = np.zeros(equations), np.zeros((equations, len(theta)))
        filtered[:, :parameters] = regression.gradient
        for k, (d, a) in enumerate(self._slices(equations)):
            for i, then in zip(range(d.start, d.stop), past, strict=False):
                error = then.target[k] - then.gradient[k] @ theta[:parameters]
                if error == error:  # else it was not measured
                    expected[k] -= theta[i] * error
                    filtered[k, :parameters] += theta[i] * then.gradient[k]
                    filtered[k, i] -= error
            for j, then in zip(range(a.start, a.stop), past, strict=False):
                expected[k] += theta[j] * then.error[k]
                filtered[k, j] += then.error[k]
            for j, then in zip(range(a.start, a.stop), past, strict=False):
                filtered[k] -= theta[j] * then.filtered[k]
        return expected, filtered

    def _passed_on(self, state: GaussNewtonState, regression: Regression) -> MotionErrors | None:
        """The errors of the motion in eps: through the noise model, as Psi is; they change little within its orders."""
        errors = regression.errors
        if errors is None:
            return None
        filtered, theta = errors.gradient.copy(), state.rls.theta
        for k, (d, a) in enumerate(self._slices(len(filtered))):
            for i, then in zip(range(d.start, d.stop), state.past, strict=False):
                if then.target[k] == then.target[k]:
                    filtered[k] += theta[i] * then.errors[k]
            for j, then in zip(range(a.start, a.stop), state.past, strict=False):
                filtered[k] -= theta[j] * then.errors_filtered[k]
        return errors._replace(gradient=filtered)

    def _slices(self, equations: int) -> list[tuple[slice, slice]]:
        """Where each equation's d and a stand in theta."""
        start, found = len(self.settings.initial), []
        for p, q in self.orders(equations):
            found.append((slice(start, start + p), slice(start + p, start + p + q)))
            start += p + q
        return found

    def _stable(self, theta: np.ndarray, equations: int) -> np.ndarray:
        theta = theta.copy()
        for d, a in self._slices(equations):
            theta[d], theta[a] = stable(theta[d], self.largest_root), stable(theta[a], self.largest_root)
        return theta

    def _rls(self, equations: int) -> Rls:
        s, more = self.settings, np.ones(sum(p + q for p, q in self.orders(equations)))
        wide = Theta(
            s.names + ("",) * len(more),
            np.concatenate([s.initial, np.zeros(len(more))]),
            np.concatenate([s.std, COEFFICIENT_STD * more]),
            np.concatenate([s.lower, -np.inf * more]),
            np.concatenate([s.upper, np.inf * more]),
            np.concatenate([s.scale, more]),
        )
        return Rls(
            wide, self.forgetting, self.memory,
            noise_floor=self.noise_floor, forget_excited=self.forget_excited, constrained=self.constrained,
        )  # fmt: skip
