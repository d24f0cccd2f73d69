"""Damping once the stiffness is known (thesis 7.3): fewer unknowns while there is little data.

Any method, with the damping of an element held at its initial value ("reduce" in figure 6.6) until the standard
deviation of that element's stiffness, as far as noise goes, is below `share` of its value; from then on it is estimated
as well. Errors of the motion and the lag do not count here: they need not fall with time. Until then the stiffness
takes up some of the damping's force. A method that forgets, or whose stiffness drifts, gives it back; one with a
constant stiffness keeps part of it.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..estimate import Event
from ..regression import Regression
from ..structure import ModelError
from .update import Theta, Update


class LaterState(NamedTuple):
    inner: Any
    waiting: np.ndarray  # (p,) dampings that are still held
    theta: np.ndarray  # (p,)
    std: np.ndarray  # (p,)


@dataclass(frozen=True)
class DampingLater:
    """Settings: the method, and how well a stiffness must be known."""

    method: Any
    share: float

    def __post_init__(self):
        if not self.share > 0.0:
            raise ModelError(f"damping_after must be above 0 (a share of the stiffness), got {self.share:g}")

    @property
    def settings(self) -> Theta:
        return self.method.settings

    @property
    def regressor_errors(self) -> bool:
        return bool(self.method.regressor_errors)

    def extra_names(self, equations: tuple[str, ...]) -> dict[str, str]:
        names = getattr(self.method, "extra_names", None)
        return names(equations) if names else {}

    def init(self, equations: int) -> LaterState:
        s = self.settings
        damping = np.array([".damping" in name for name in s.names], dtype=bool)
        return LaterState(self.method.init(equations), damping & (s.std > 0.0), s.initial, s.std)

    def update(self, state: LaterState, regression: Regression) -> tuple[LaterState, Update]:
        waiting, events = self._released(state)
        held = np.where(waiting, state.theta, 0.0)
        reduced = regression._replace(
            known=regression.known + regression.gradient @ held,
            gradient=np.where(waiting, 0.0, regression.gradient),
            active=regression.active & ~waiting,
        )
        if not (reduced.gradient[~np.isnan(regression.measured)] != 0.0).any():
            return state, self._unchanged(state, regression)
        inner, update = self.method.update(state.inner, reduced)
        state = LaterState(inner, waiting, update.theta, np.sqrt(np.diagonal(update.covariance)))
        return state, update._replace(events=update.events + events)

    def _released(self, state: LaterState) -> tuple[np.ndarray, tuple[Event, ...]]:
        waiting, events = state.waiting.copy(), []
        for k in np.flatnonzero(waiting):
            element = self.settings.names[k].split(".")[0]
            stiffness = self.settings.names.index(f"{element}.stiffness")
            known = state.std[stiffness] / max(abs(state.theta[stiffness]), 1e-300)
            if known < self.share:
                waiting[k] = False
                text = f"{self.settings.names[k]}: estimated from here on, the stiffness is known to {known:.1%}"
                events.append(Event("released", self.settings.names[k], float(known), text))
        return waiting, tuple(events)

    def _unchanged(self, state: LaterState, regression: Regression) -> Update:
        noise = np.diag(np.nan_to_num(regression.noise, nan=1.0))
        return Update(state.theta, np.diag(state.std**2), noise, np.zeros(len(state.theta), dtype=bool))
