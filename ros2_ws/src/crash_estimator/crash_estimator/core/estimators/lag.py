"""The lag of a method that takes theta as constant within a memory: a filter beside it lets theta walk.

How late a method is it cannot tell from its own recursion: after an abrupt change large errors lessen the weight of
what is new (Lambda of RLS), and what was before keeps hold for many memories. The filter is the Kalman filter of
`kalman.py`, with the walk that the model states (`drift`), its own R2 learnt from what it cannot follow, the errors of
the motion, and the regression that the method has at the same sample. It does nothing to theta; how far it is from it,
and how sure, is what `regressor_errors.late` states. Where the model lets nothing walk there is no lag.
"""

from typing import TypeAlias

import numpy as np

from ..regression import Regression
from ..regressor_errors import late
from .kalman import Kalman, KalmanState
from .update import Theta

Walking: TypeAlias = KalmanState | None
"""What is remembered of the filter; None before the first sample, and where there is no lag."""


def followed(settings: Theta, state: Walking, regression: Regression) -> Walking:
    """The filter after one sample; None: the model lets nothing walk, or the setting `regressor_errors` is off."""
    if regression.errors is None or not settings.drifts:
        return None
    kalman = Kalman(settings, offsets=False)
    return kalman.update(state or kalman.init(len(regression.known)), regression)[0]


def of_first(regression: Regression, theta: np.ndarray, p: int) -> Regression:
    """The regression of the first p parameters alone; the others, of a noise model, are as theta (w,) has them."""
    return regression._replace(
        known=regression.known + regression.gradient[:, p:] @ theta[p:],
        gradient=regression.gradient[:, :p],
        active=regression.active[:p],
        walk=regression.walk[:p],
    )


def with_lag(own: np.ndarray, theta: np.ndarray, state: Walking) -> np.ndarray:
    """(p, p) what is stated of theta (p,): `own`, the method's noise and errors of the motion, where nothing walks."""
    if state is None or state.beside is None:
        return own
    return late(state.theta - theta, state.covariance + state.beside.covariance)
