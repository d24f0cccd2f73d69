"""The linear regression of one sample: y = Psi theta + e (equation 4.1 with the known terms moved to the left).

    y = measured - known,    Psi = d(prediction) / d(theta)

A parameter that is known, or whose element is apart, has left Psi ("reduce" in figure 6.6); its value
returns unchanged ("expand").
"""

from typing import NamedTuple

import numpy as np

from .contact import SpringLaw
from .estimate import ParameterStatus
from .kinematics import Motion
from .structure import Parameter, Structure

SHORTEST_CRUSH = 1e-3
"""m: below this crush e-folds are not counted; it would take infinitely many to leave zero."""

QUIETEST = 1e-3
"""m/s^2 or N: less noise than any sensor has; it keeps the noise covariance invertible on noise-free data."""

DRIFT = {"curve": 0.5, "constant": 0.0}
"""Default drift of a stiffness by its shape: a curve's secant changes by half its value per e-fold of crush."""


class Regression(NamedTuple):
    """One sample for p parameters, q equations and e elements."""

    known: np.ndarray  # (q,) prediction by what is known
    gradient: np.ndarray  # (q, p) Psi; zero columns for parameters that are not active
    measured: np.ndarray  # (q,) NaN where there is no valid measurement
    active: np.ndarray  # (p,) whether the parameter is estimated at this sample
    walk: np.ndarray  # (p,) relative variance of a random walk: drift^2 times the e-folds of crush since the last sample
    noise: np.ndarray  # (q,) variance of the measurement, given or from before the impact; NaN where not known
    dt: float  # s since the last sample


class Forces(NamedTuple):
    """The elements' forces as linear functions of theta: F = per_unit theta + shift."""

    per_unit: np.ndarray  # (e, p)
    shift: np.ndarray  # (e,) N


class Regressor:
    """Turns motion and contact into the regression."""

    def __init__(self, structure: Structure):
        parameters = structure.parameters
        self.share = structure.force_to_equation
        self.element = np.array([p.element for p in parameters], dtype=int)
        self.of_element = np.equal.outer(np.arange(len(structure.elements)), self.element).astype(float)
        self.is_stiffness = np.array([p.is_stiffness for p in parameters], dtype=bool)
        self.stiffness_index = np.flatnonzero(self.is_stiffness)  # in the order of the elements
        self.estimated = np.array([p.coefficient.estimated for p in parameters], dtype=bool)
        self.value = np.where(self.estimated, 0.0, [p.coefficient.value for p in parameters])
        self.drift_squared = np.array([self._drift(p) ** 2 for p in parameters])
        self.noise = np.array([structure.bodies[k].noise or np.nan for k in structure.equations]) ** 2

    @staticmethod
    def _drift(parameter: Parameter) -> float:
        coefficient = parameter.coefficient
        if not coefficient.estimated:
            return 0.0
        if coefficient.drift is not None:
            return coefficient.drift
        return DRIFT[coefficient.shape] if parameter.is_stiffness else 0.0

    def make(self, motion: Motion, law: SpringLaw) -> tuple[Regression, Forces]:
        carries = law.carries[self.element]
        lever = np.where(self.is_stiffness, law.lever[self.element], np.where(carries, motion.rate[self.element], 0.0))
        forces = Forces(self.of_element * lever, law.shift)
        active = self.estimated & carries
        known = self.share @ (forces.per_unit @ self.value + law.shift)
        gradient = np.where(active, self.share @ forces.per_unit, 0.0)
        folds = np.abs(motion.rate) * motion.dt / np.maximum(np.abs(motion.crush), SHORTEST_CRUSH)
        walk = np.where(active & ~law.on_line[self.element], self.drift_squared * folds[self.element], 0.0)
        noise = np.maximum(np.where(np.isnan(self.noise), motion.noise, self.noise), QUIETEST**2)
        return Regression(known, gradient, motion.measured, active, walk, noise, motion.dt), forces

    def status(self, law: SpringLaw, clamped: np.ndarray) -> np.ndarray:
        """(p,) ParameterStatus, uint8."""
        status = np.where(clamped, ParameterStatus.CLAMPED, ParameterStatus.ESTIMATED)
        status[law.on_line[self.element] & self.is_stiffness & ~clamped] = ParameterStatus.UNLOADING
        status[~law.carries[self.element]] = ParameterStatus.APART
        status[~self.estimated] = ParameterStatus.KNOWN
        return status.astype(np.uint8)
