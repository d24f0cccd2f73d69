"""What the estimation methods have in common: settings of theta, the result of an update, bounds."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..estimate import Event
from ..regression import drift_of
from ..structure import Structure


class Theta(NamedTuple):
    """The parameter vector's settings, all (p,)."""

    names: tuple[str, ...]
    initial: np.ndarray
    std: np.ndarray  # of the initial value; 0 for known parameters
    lower: np.ndarray
    upper: np.ndarray
    scale: np.ndarray  # order of magnitude
    drifts: bool = False  # whether the model lets any of them walk


class Update(NamedTuple):
    """What a method says after one sample: p parameters, q equations."""

    theta: np.ndarray  # (p,)
    covariance: np.ndarray  # (p, p) as the method has it
    innovation_covariance: np.ndarray  # (q, q)
    clamped: np.ndarray  # (p,) held at a bound in this step
    events: tuple[Event, ...] = ()
    expected_error: tuple[np.ndarray | float, np.ndarray | float] = (0.0, 0.0)
    # (q,) each: the error that a noise model expected, with theta before and after the update
    extra: tuple[float, ...] = ()  # what the method knows besides theta, named by its `extra_names`
    extra_std: tuple[float, ...] = ()  # of each; empty: none is known
    all_told: np.ndarray | None = None  # (p, p) of theta with errors of the motion and the lag; None: not counted

    residual_variance: np.ndarray | None = None  # (q,) of measured minus predicted after it; None: as before it

    @property
    def stated(self) -> np.ndarray:
        """(p, p) covariance that is stated of theta."""
        return self.covariance if self.all_told is None else self.all_told


def residual_variance(
    noise: np.ndarray, gradient: np.ndarray, covariance: np.ndarray, influence: np.ndarray
) -> np.ndarray:
    """(q,) Of what an update leaves, e - Psi (error of theta), of a noise e of variance R, `noise` (q,).

    The part B e of theta's error is due to e itself, B `influence` (p, q), so that with P theta's covariance after it

        R + Psi P Psi' - 2 Psi B R

    R - Psi P Psi' = R S^-1 R for the Kalman gain, B R = P Psi', and all of S where theta is held, B = 0.
    """
    spread = np.einsum("qp,pr,qr->q", gradient, covariance, gradient)
    return noise * (1.0 - 2.0 * np.einsum("qp,pq->q", gradient, influence)) + spread


def theta_settings(structure: Structure) -> Theta:
    """A stated standard deviation is kept; otherwise the initial value may be wrong by its order of magnitude."""
    parameters = structure.parameters
    stds = [
        0.0 if not p.coefficient.estimated else p.scale if p.coefficient.std is None else p.coefficient.std
        for p in parameters
    ]
    return Theta(
        tuple(p.name for p in parameters),
        np.array([p.coefficient.value for p in parameters], dtype=float),
        np.array(stds, dtype=float),
        np.array([p.coefficient.min for p in parameters], dtype=float),
        np.array([p.coefficient.max for p in parameters], dtype=float),
        np.array([p.scale for p in parameters], dtype=float),
        any(drift_of(p) > 0.0 for p in structure.element_parameters),
    )


def within_bounds(
    solve: Callable[[np.ndarray, np.ndarray], np.ndarray], theta: np.ndarray, active: np.ndarray, settings: Theta
) -> tuple[np.ndarray, np.ndarray]:
    """Solve for the active parameters; declare any that leaves its bounds known there and solve again (figure 6.6).

    solve(theta, active) -> the updated theta, with the inactive ones as given.
    Returns the updated theta and (p,) which of its parameters are held at a bound.
    """
    clamped = np.zeros(len(theta), dtype=bool)
    while True:
        updated = solve(theta, active & ~clamped)
        outside = active & ~clamped & ((updated < settings.lower) | (updated > settings.upper))
        if not outside.any():
            return updated, clamped
        theta = np.where(outside, np.clip(updated, settings.lower, settings.upper), theta)
        clamped = clamped | outside
