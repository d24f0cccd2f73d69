"""Means of the regression over an interval: vibrations average out, impulse and momentum remain."""

from typing import NamedTuple

import numpy as np

from ..regression import Regression


class Window(NamedTuple):
    """Sums over the samples since the last mean was taken: q equations, p parameters."""

    samples: np.ndarray  # (q,) valid ones
    target: np.ndarray  # (q,) measured minus known
    gradient: np.ndarray  # (q, p)
    noise: np.ndarray  # (q,) variance of a sample
    active: np.ndarray  # (p,)
    duration: float  # s
    by_errors: np.ndarray | float  # (q, b, 3) of the errors of the motion


def widened(window: Window | None, regression: Regression) -> Window:
    """The window with one more sample; None starts one."""
    valid = ~np.isnan(regression.measured)
    target = np.where(valid, regression.measured - regression.known, 0.0)
    gradient = np.where(valid[:, None], regression.gradient, 0.0)
    noise = np.where(valid, np.nan_to_num(regression.noise, nan=1.0), 0.0)
    errors = regression.errors
    by_errors = 0.0 if errors is None else np.where(valid[:, None, None], errors.gradient, 0.0)
    if window is None:
        return Window(valid.astype(float), target, gradient, noise, regression.active, regression.dt, by_errors)
    return Window(
        window.samples + valid, window.target + target, window.gradient + gradient, window.noise + noise,
        window.active | regression.active, window.duration + regression.dt, window.by_errors + by_errors,
    )  # fmt: skip


def mean_of(window: Window, now: Regression) -> Regression:
    """The window's means as one regression; NaN where an equation had no valid sample."""
    count = np.where(window.samples > 0, window.samples, np.nan)
    target, nothing = window.target / count, np.zeros(len(window.target))
    gradient = np.nan_to_num(window.gradient / count[:, None])
    noise = np.nan_to_num(window.noise / count**2, nan=1.0)
    still = np.zeros(len(window.active))
    errors = now.errors
    if errors is not None:
        errors = errors._replace(gradient=np.nan_to_num(window.by_errors / count[:, None, None]))
    return Regression(nothing, gradient, target, window.active, still, noise, window.duration, now.time, errors=errors)
