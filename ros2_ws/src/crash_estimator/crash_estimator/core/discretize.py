"""Continuous and discrete time (thesis 3.5.2):  dZ/dt = Ac Z + Bc X   and   Z_{k+1} = Ad Z_k + Bd X_k,  step T.

    indirect   Ad = e^(Ac T),  Bd = integral over 0..T of e^(Ac t) dt Bc          exact for X held over a step
    direct     Z_{k+1} - Z_k = T/2 [Ac (Z_{k+1} + Z_k) + Bc (X_{k+1} + X_k)]       trapezoidal, T small

The direct form gives Ad = (I - Ac T/2)^-1 (I + Ac T/2), Bd = (I - Ac T/2)^-1 Bc T, with X the mean over the step.
Back from a discrete model: a noise model's D(B), found from samples, is a vibration with a frequency and a damping.
"""

from typing import NamedTuple

import numpy as np

from .estimators.noise_model import NoiseModel
from .structure import ModelError

TERMS = 18
"""Of the exponential's series; after scaling to a norm below 1/2 what is left out is below 1e-20."""


class Mode(NamedTuple):
    """One vibration in a noise model."""

    frequency: float  # Hz, undamped; 0 for one that only decays
    damping: float  # share of the critical one; 1 and more: decays without oscillating
    decay_time: float  # s to a share of 1/e


def exponential(matrix: np.ndarray) -> np.ndarray:
    """e^A of a matrix (n, n): the series I + A + A^2/2! + ..., scaled and squared."""
    squarings = max(0, int(np.ceil(np.log2(max(np.abs(matrix).sum(axis=1).max(initial=0.0), 1e-300)))) + 1)
    scaled, term = matrix / 2.0**squarings, np.eye(len(matrix))
    total = term
    for k in range(1, TERMS + 1):
        term = term @ scaled / k
        total = total + term
    for _ in range(squarings):
        total = total @ total
    return total


def logarithm(matrix: np.ndarray) -> np.ndarray:
    """The real matrix (n, n) whose exponential is the given one, with frequencies below half the sampling rate.

    Raises ModelError where there is none: an eigenvalue that is zero or negative, or too few eigenvectors.
    """
    values, vectors = np.linalg.eig(matrix)
    if ((np.abs(values.imag) < 1e-12) & (values.real <= 0.0)).any():
        raise ModelError("no continuous model has this discrete one: an eigenvalue is zero or negative; sample faster")
    if np.linalg.cond(vectors) > 1e10:
        raise ModelError("the discrete model's eigenvalues coincide: use the direct form")
    return np.real(vectors @ np.diag(np.log(values.astype(complex))) @ np.linalg.inv(vectors))


def to_discrete(ac: np.ndarray, bc: np.ndarray, step: float, direct: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """(Ad, Bd) of dZ/dt = Ac Z + Bc X; ac (n, n) 1/s, bc (n, m), step in s."""
    n, m = bc.shape
    if direct:
        left = np.eye(n) - 0.5 * step * ac
        return np.linalg.solve(left, np.eye(n) + 0.5 * step * ac), np.linalg.solve(left, bc * step)
    both = exponential(step * np.block([[ac, bc], [np.zeros((m, n + m))]]))
    return both[:n, :n], both[:n, n:]


def to_continuous(ad: np.ndarray, bd: np.ndarray, step: float, direct: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """(Ac, Bc) of Z_{k+1} = Ad Z_k + Bd X_k, the inverse of `to_discrete`; raises ModelError where there is none."""
    n, m = bd.shape
    if direct:
        ac = 2.0 / step * np.linalg.solve((ad + np.eye(n)).T, (ad - np.eye(n)).T).T
        return ac, (np.eye(n) - 0.5 * step * ac) @ bd / step
    ac = logarithm(ad) / step
    _, unit = to_discrete(ac, np.eye(n), step)
    return ac, np.linalg.solve(unit, bd)


def modes(model: NoiseModel, step: float) -> list[Mode]:
    """The vibrations in a noise model's D(B), the slowest to decay first: the indirect way, by its companion matrix."""
    p = len(model.d)
    if not p:
        return []
    companion = np.vstack([-model.d, np.eye(p)[: p - 1]])
    found = []
    for root in np.linalg.eigvals(companion).astype(complex):
        if abs(root) < 1e-9 or root.imag < 0.0:  # one of a pair stands for both; a root at 0 is a mere delay
            continue
        s = np.log(root) / step
        frequency = abs(s) / (2.0 * np.pi) if root.imag > 0.0 else 0.0
        found.append(Mode(float(frequency), float(-s.real / abs(s)), float(-1.0 / s.real) if s.real else np.inf))
    return sorted(found, key=lambda mode: -mode.decay_time)
