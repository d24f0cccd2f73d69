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
    time: float = 0.0  # s since the impact
    offset_gradient: np.ndarray | None = None  # (q, b) d(prediction) / d(error of each body's zero offset)
    offset_variance: np.ndarray | None = None  # (b,) (m/s^2)^2 of that error


class Forces(NamedTuple):
    """The elements' forces as linear functions of theta: F = per_unit theta + shift."""

    per_unit: np.ndarray  # (e, p)
    shift: np.ndarray  # (e,) N


class Further:
    """Parameters beyond stiffness and damping: higher powers of crush and rate, estimated unloading slopes."""

    def __init__(self, structure: Structure):
        parameters, elements = structure.parameters, structure.elements
        self.element = np.array([p.element for p in parameters], dtype=int)
        self.power = np.array([p.power for p in parameters])
        self.of_crush = np.array([p.unit.startswith("N/m^") for p in parameters], dtype=bool)
        self.is_unloading = np.array([p.is_unloading for p in parameters], dtype=bool)
        self.unloading_index = np.flatnonzero(self.is_unloading)
        self.estimated_slope = np.array([e.unloading_slope is not None for e in elements], dtype=bool)
        self.known_slope = np.array([e.unloading or 0.0 for e in elements])

    def lever(self, first: np.ndarray, motion: Motion, law: SpringLaw) -> np.ndarray:
        """(p,) what each parameter is multiplied with; `first`: the lever of the first power."""
        base = np.where(self.of_crush, law.lever[self.element], first)
        lever = np.where(self.power == 1, first, np.sign(base) * np.abs(base) ** self.power)
        back = np.where(law.on_line, motion.crush - law.lever, 0.0)
        return np.where(self.is_unloading, back[self.element], lever)

    def known(self, shift: np.ndarray) -> np.ndarray:
        """(e,) The unloading line's known part: none where its slope is estimated."""
        return np.where(self.estimated_slope, 0.0, shift)

    def slope(self, theta: np.ndarray) -> np.ndarray:
        slope = self.known_slope.copy()
        slope[self.element[self.unloading_index]] = theta[self.unloading_index]
        return slope

    def secant(self, stiffness: np.ndarray, theta: np.ndarray, peak: np.ndarray) -> np.ndarray:
        secant = stiffness.copy()
        higher = np.flatnonzero(self.of_crush)
        np.add.at(secant, self.element[higher], theta[higher] * peak[self.element[higher]] ** (self.power[higher] - 1))
        return secant


class Regressor:
    """Turns motion and contact into the regression."""

    def __init__(self, structure: Structure):
        parameters = structure.parameters
        self.share = structure.force_to_equation
        self.element = np.array([p.element for p in parameters], dtype=int)
        self.of_element = np.equal.outer(np.arange(len(structure.elements)), self.element).astype(float)
        self.is_stiffness = np.array([p.is_stiffness for p in parameters], dtype=bool)
        self.further = None if structure.first_order else Further(structure)
        self.stiffness_index = np.flatnonzero(self.is_stiffness)  # in the order of the elements
        self.damping_index = self.stiffness_index + 1
        self.own_offset = np.zeros((len(structure.equations), len(structure.bodies)))
        self.crush_of_body = np.zeros((len(structure.elements), len(structure.bodies)))
        for row, k in enumerate(structure.equations):
            self.own_offset[row, k] = structure.bodies[k].free
        for k, element in enumerate(structure.elements):
            if not element.displacement:
                self.crush_of_body[k, structure.ends[k]] = 1.0, -1.0
        self.estimated = np.array([p.coefficient.estimated for p in parameters], dtype=bool)
        self.value = np.where(self.estimated, 0.0, [p.coefficient.value for p in parameters])
        self.known_unloading = np.array([e.unloading or 0.0 for e in structure.elements])
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

    def make(self, motion: Motion, law: SpringLaw, theta: np.ndarray) -> tuple[Regression, Forces]:
        """theta (p,): the latest values, for what depends on them: the forces' change with the zero offsets' errors."""
        carries = law.carries[self.element]
        lever = np.where(self.is_stiffness, law.lever[self.element], np.where(carries, motion.rate[self.element], 0.0))
        shift = law.shift
        if self.further is not None:
            lever, shift = self.further.lever(lever, motion, law), self.further.known(shift)
        forces = Forces(self.of_element * lever, shift)
        active = self.estimated & carries
        known = self.share @ (forces.per_unit @ self.value + shift)
        gradient = np.where(active, self.share @ forces.per_unit, 0.0)
        folds = np.abs(motion.rate) * motion.dt / np.maximum(np.abs(motion.crush), SHORTEST_CRUSH)
        walk = np.where(active & ~law.on_line[self.element], self.drift_squared * folds[self.element], 0.0)
        noise = np.maximum(np.where(np.isnan(self.noise), motion.noise, self.noise), QUIETEST**2)
        offset_gradient = self.own_offset + self.share @ self._per_offset(motion, law, theta)
        return (
            Regression(
                known, gradient, motion.measured, active, walk, noise, motion.dt, motion.time,
                offset_gradient, motion.offset_variance,
            ),
            forces,
        )  # fmt: skip

    def _per_offset(self, motion: Motion, law: SpringLaw, theta: np.ndarray) -> np.ndarray:
        """(e, b) N s^2/m. An accelerometer whose zero is wrong by b has moved its body by b t^2 / 2 too far and made it
        b t too fast, and so changed the element's force by -(dF/dX t^2 / 2 + dF/dV t) b."""
        slope = self.secant(theta, law.lever)
        unloading = self.unloading(theta)
        slope = np.where(law.on_line, self.known_unloading if unloading is None else unloading, slope)
        change = 0.5 * motion.time**2 * slope + motion.time * theta[self.damping_index]
        return -np.where(law.carries, change, 0.0)[:, None] * self.crush_of_body

    def secant(self, theta: np.ndarray, peak: np.ndarray) -> np.ndarray:
        """(e,) N/m: each element's stiffness, at the crush `peak` (e,) where it has higher powers."""
        stiffness = theta[self.stiffness_index]
        return stiffness if self.further is None else self.further.secant(stiffness, theta, peak)

    def unloading(self, theta: np.ndarray) -> np.ndarray | None:
        """(e,) N/m: the unloading slopes, where one is estimated."""
        return None if self.further is None else self.further.slope(theta)

    def status(self, law: SpringLaw, clamped: np.ndarray) -> np.ndarray:
        """(p,) ParameterStatus, uint8."""
        status = np.where(clamped, ParameterStatus.CLAMPED, ParameterStatus.ESTIMATED)
        status[law.on_line[self.element] & self.is_stiffness & ~clamped] = ParameterStatus.UNLOADING
        status[~law.carries[self.element]] = ParameterStatus.APART
        status[~self.estimated] = ParameterStatus.KNOWN
        return status.astype(np.uint8)
