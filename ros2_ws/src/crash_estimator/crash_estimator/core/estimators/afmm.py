"""Adaptive forgetting through multiple models (Andersson 1985; thesis 4.4.3, figure 4.13): a bank that finds jumps.

Between jumps the parameters are constant. Each model of the bank is a Kalman filter that has assumed a jump at a
time of its own, so that it has forgotten what was before; its weight is its posterior probability:

    w_i <- w_i N(innovation_i; 0, S_i) / sum                         every `interval`
    the least likely model is given up; the most likely one, i, is continued twice:
        without a jump, weight w_i (1 - probability), and with one, weight w_i probability, P += (jump scale)^2

theta is the mean of the models by weight. Where the models that jumped since the last reported jump have together
more than `threshold` of the weight, the jump of the most likely one is reported: later than it happened, but with
the time at which it did.

The models see means over `interval`. A structure's vibrations are neither white nor part of the model; sample by
sample they would pass for jumps. R2, the variance of those means, is learnt from the most likely model.

The thesis prints no recursion of it but names Andersson's. `THESIS` is the bank above on every sample, R2
known and the integrated motion taken as true.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..estimate import Event
from ..regression import Regression
from ..structure import ModelError
from .kalman import Kalman, KalmanState
from .lag import Walking, followed, with_lag
from .update import Theta, Update
from .window import Window, mean_of, widened

RESOLUTION = 1.5
"""Intervals: a jump within one looks like two, at its beginning and at its end; they are reported as one."""

THESIS = {"interval": 0.0, "noise_memory": 0.0, "regressor_errors": False}
"""Settings without the means and the learning of R2 that Andersson's bank does not have."""


class Model(NamedTuple):
    """One member of the bank."""

    filter: KalmanState
    log_weight: float
    jumped: float  # s since the impact: the last jump that it has assumed; -inf: none
    update: Update
    products: np.ndarray  # (q,) innovation times residual at the last step: their mean is R2


class AfmmState(NamedTuple):
    models: tuple[Model, ...]
    window: Window | None
    noise: np.ndarray  # (q,) R2 of a mean over the interval; NaN until known
    sample_noise: np.ndarray  # (q,) variance of a sample's residual
    reported: float  # s since the impact: the last jump reported
    update: Update
    lag: Walking = None  # the filter beside the bank


@dataclass(frozen=True)
class Afmm:
    """Settings of the bank."""

    settings: Theta
    models: int = 10
    interval: float = 1e-3  # s between updates, and between the jumps assumed; 0: every sample
    probability: float = 1e-4  # of a jump in one interval
    jump: float = 1.0  # standard deviation of a jump, times each parameter's scale
    threshold: float = 0.9  # probability from which a jump is reported
    noise_memory: float = 0.01  # s over which R2 is learnt; 0 keeps the noise known before the impact
    constrained: bool = False  # whether the models keep the parameters' bounds; a jump may lead beyond them
    regressor_errors: bool = True  # count errors of the integrated motion and the lag; hold what they hide

    def __post_init__(self):
        if not 1 <= self.models <= 1000:
            raise ModelError(f"models must be from 1 to 1000, got {self.models} (setting of afmm)")
        for name in ("probability", "threshold"):
            if not 0.0 < getattr(self, name) < 1.0:
                raise ModelError(f"{name} must be between 0 and 1, got {getattr(self, name):g} (setting of afmm)")

    def extra_names(self, equations: tuple[str, ...]) -> dict[str, str]:
        """Name -> unit of `Update.extra`: weight and time of the last jump, likeliest model first; jump NaN: none."""
        return {f"model{k}.{what}": unit for k in range(self.models) for what, unit in (("weight", "1"), ("jump", "s"))}

    def init(self, equations: int) -> AfmmState:
        start = self._filter.init(equations)
        unknown, none = np.full(equations, np.nan), np.zeros((equations, equations))
        update = Update(start.theta, start.covariance, none, np.zeros(len(start.theta), dtype=bool))
        return AfmmState((Model(start, 0.0, -np.inf, update, unknown),), None, unknown, unknown, -np.inf, update)

    def update(self, state: AfmmState, regression: Regression) -> tuple[AfmmState, Update]:
        window = widened(state.window, regression)
        events: tuple[Event, ...] = ()
        if window.duration >= self.interval * (1.0 - 1e-6):
            state, events = self._step(state, window, regression)
            window = None
        lag = followed(self.settings, state.lag, regression)  # sample by sample: between steps theta is late as well
        state = self._learn_sample_noise(state._replace(window=window, lag=lag), regression)
        spread = regression.gradient @ state.update.covariance @ regression.gradient.T
        update = state.update._replace(
            innovation_covariance=np.diag(state.sample_noise) + spread, events=events,
            all_told=with_lag(state.update.stated, state.update.theta, lag),
        )  # fmt: skip
        return state._replace(update=state.update._replace(events=())), update

    @property
    def _filter(self) -> Kalman:
        return Kalman(self.settings, constrained=self.constrained, noise_memory=0, offsets=False)

    def _step(self, state: AfmmState, window: Window, now: Regression) -> tuple[AfmmState, tuple[Event, ...]]:
        """The bank's step on the means over the window."""
        mean = mean_of(window, now)
        noise = np.where(np.isnan(state.noise), mean.noise, state.noise)
        models = _normalised([self._weighed(model, mean, noise) for model in state.models])
        best = _likeliest(models)
        noise = self._learn_noise(noise, mean, best.products)
        reported = state.reported
        events: tuple[Event, ...] = ()
        known = reported + RESOLUTION * self.interval
        late = sum(np.exp(model.log_weight) for model in models if model.jumped > known)
        if late > self.threshold and best.jumped > known:
            reported, events = best.jumped, (self._event(best, late, state, now.time),)
        update = self._combined(models)
        return state._replace(
            models=self._branched(models, now.time), noise=noise, reported=reported, update=update
        ), events

    def _weighed(self, model: Model, mean: Regression, noise: np.ndarray) -> Model:
        """The model after one step of its filter, its weight times the likelihood of what it did not expect."""
        innovation = mean.measured - mean.known - mean.gradient @ model.filter.theta
        state, update = self._filter.update(model.filter._replace(noise=noise), mean)
        valid = ~np.isnan(innovation)
        covariance = update.innovation_covariance[np.ix_(valid, valid)]
        _, log_determinant = np.linalg.slogdet(covariance)
        squares = innovation[valid] @ np.linalg.solve(covariance, innovation[valid])
        residual = mean.measured - mean.known - mean.gradient @ state.theta
        log_weight = model.log_weight - 0.5 * (squares + log_determinant)
        return Model(state, log_weight, model.jumped, update, innovation * residual)

    def _branched(self, models: tuple[Model, ...], time: float) -> tuple[Model, ...]:
        """The least likely model makes room for the likeliest one's continuation with a jump."""
        if self.models == 1:
            return models
        best = _likeliest(models)
        kept = sorted(models, key=lambda model: -model.log_weight)[: self.models - 1]
        variance = np.where(self.settings.std > 0.0, self.jump * self.settings.scale, 0.0) ** 2
        jumped = best.filter.widened(variance)
        branch = Model(jumped, best.log_weight + np.log(self.probability), time, best.update, best.products)
        kept[0] = best._replace(log_weight=best.log_weight + np.log1p(-self.probability))
        return (*kept, branch)

    def _combined(self, models: tuple[Model, ...]) -> Update:
        """Mean and covariance of the mixture."""
        weights = np.exp([model.log_weight for model in models])
        theta = sum(w * model.filter.theta for w, model in zip(weights, models))
        covariance, all_told = np.zeros((2, len(theta), len(theta)))
        for w, model in zip(weights, models):
            away = model.filter.theta - theta
            own = w * (model.filter.covariance + np.outer(away, away))
            covariance += own
            all_told += own + w * model.filter.beside.covariance
        ranked = sorted(models, key=lambda model: -model.log_weight)
        extra = [x for m in ranked for x in (float(np.exp(m.log_weight)), m.jumped if m.jumped > -np.inf else np.nan)]
        extra += [0.0, np.nan] * (self.models - len(ranked))
        return ranked[0].update._replace(
            theta=theta, covariance=covariance, extra=tuple(extra), all_told=all_told, residual_variance=None
        )

    def _event(self, best: Model, probability: float, state: AfmmState, time: float) -> Event:
        change = np.where(self.settings.std > 0.0, best.filter.theta - state.update.theta, 0.0) / self.settings.scale
        name = self.settings.names[int(np.argmax(np.abs(change)))]
        text = (
            f"{name}: jumped at {best.jumped * 1e3:.1f} ms, probability {probability:.3f}, seen at {time * 1e3:.1f} ms"
        )
        return Event("jump", name, float(probability), text)

    def _learn_noise(self, noise: np.ndarray, mean: Regression, products: np.ndarray) -> np.ndarray:
        if not self.noise_memory:
            return noise
        share = mean.dt / (mean.dt + self.noise_memory)
        known = np.where(np.isnan(products), noise, np.maximum(products, 0.0))
        return np.fmax(noise + share * (known - noise), mean.noise)

    def _learn_sample_noise(self, state: AfmmState, regression: Regression) -> AfmmState:
        residual = regression.measured - regression.known - regression.gradient @ state.update.theta
        noise = np.nan_to_num(regression.noise, nan=1.0)
        before = np.where(np.isnan(state.sample_noise), noise, state.sample_noise)
        share = regression.dt / (regression.dt + self.noise_memory) if self.noise_memory else 0.0
        learnt = before + share * (np.where(np.isnan(residual), before, residual**2) - before)
        return state._replace(sample_noise=np.fmax(learnt, noise))


def _likeliest(models: tuple[Model, ...]) -> Model:
    return max(models, key=lambda model: model.log_weight)


def _normalised(models: list[Model]) -> tuple[Model, ...]:
    logs = np.array([model.log_weight for model in models])
    total = logs.max() + np.log(np.exp(logs - logs.max()).sum())
    return tuple(model._replace(log_weight=float(log - total)) for model, log in zip(models, logs))
