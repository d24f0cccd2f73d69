"""The linear regression of one sample: y = Psi theta + e (equation 4.1 with the known terms moved to the left).

    y = measured - known,    Psi = d(prediction) / d(theta)

A parameter that is known, or whose element is apart, has left Psi ("reduce" in figure 6.6); its value
returns unchanged ("expand"). A stiffness whose crush is hidden in its own error stays in Psi and is held: a method
takes it as it is, not as known.
"""

from typing import NamedTuple

import numpy as np

from .actions import Actions
from .contact import SpringLaw
from .estimate import ParameterStatus
from .kinematics import Motion
from .regressor_errors import HIDDEN, MotionErrors
from .structure import Parameter, Structure
from .structure_parts import outlasts

SHORTEST_CRUSH = 1e-3
"""m: below this crush e-folds are not counted; it would take infinitely many to leave zero."""

QUIETEST = 1e-3
"""m/s^2 or N: less noise than any sensor has; it keeps the noise covariance invertible on noise-free data."""

DRIFT = {"curve": 0.5, "constant": 0.0}
"""Default drift of a stiffness by its shape: a curve's secant changes by half its value per e-fold of crush."""


class Regression(NamedTuple):
    """One sample for p parameters, q equations and e elements."""

    known: np.ndarray  # (q,) prediction by what is known
    gradient: np.ndarray  # (q, p) Psi; zero columns for parameters that are known, or whose element is apart
    measured: np.ndarray  # (q,) NaN where there is no valid measurement
    active: np.ndarray  # (p,) whether the parameter is estimated at this sample; where not, its error is still counted
    walk: (
        np.ndarray
    )  # (p,) relative variance of a random walk: drift^2 times the e-folds of crush since the last sample
    noise: np.ndarray  # (q,) variance of the measurement, given or from before the impact; NaN where not known
    dt: float  # s since the last sample
    time: float = 0.0  # s since the impact
    offset_gradient: np.ndarray | None = None  # (q, b) d(prediction) / d(error of each body's zero offset)
    offset_variance: np.ndarray | None = None  # (b,) (m/s^2)^2 of that error
    errors: MotionErrors | None = None  # of the integrated motion; None: it is taken as true


class Forces(NamedTuple):
    """The elements' forces as linear functions of theta: F = per_unit theta + shift."""

    per_unit: np.ndarray  # (e, p)
    shift: np.ndarray  # (e,) N


class Further:
    """Parameters beyond stiffness and damping: higher powers of crush and rate, estimated unloading slopes."""

    def __init__(self, structure: Structure):
        parameters, elements = structure.element_parameters, structure.elements
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


def drift_of(parameter: Parameter) -> float:
    """Standard deviation of the parameter's random walk, a share of its value, per e-fold of crush."""
    coefficient = parameter.coefficient
    if not coefficient.estimated:
        return 0.0
    if coefficient.drift is not None:
        return coefficient.drift
    return DRIFT[coefficient.shape] if parameter.is_stiffness else 0.0


class Regressor:
    """Turns motion and contact into the regression."""

    def __init__(self, structure: Structure, regressor_errors: bool = True):
        """regressor_errors: the integrated motion errs, and a coefficient is held until its crush is known; else the
        motion is taken as true."""
        self.regressor_errors = regressor_errors
        parameters = structure.element_parameters
        self.actions = Actions(structure) if structure.actions else None
        self.factors = [(k, element.factor) for k, element in enumerate(structure.elements) if element.factor]
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
            self.own_offset[row, k] = 1.0
        for k, element in enumerate(structure.elements):
            for sign, end in zip((1.0, -1.0), structure.ends[k]):
                integrated = structure.bodies[end].acceleration and not element.displacement
                self.crush_of_body[k, end] = sign if integrated else 0.0
        self.velocity_variance = np.array([body.velocity_std for body in structure.bodies]) ** 2
        self.estimated = np.array([p.coefficient.estimated for p in parameters], dtype=bool)
        self.value = np.where(self.estimated, 0.0, [p.coefficient.value for p in parameters])
        self.known_unloading = np.array([e.unloading or 0.0 for e in structure.elements])
        self.of_spring = np.array(
            [p.is_stiffness or p.is_unloading or p.unit.startswith("N/m^") for p in parameters], dtype=bool
        )
        lasting = np.array([outlasts(element.acts_when_spent) for element in structure.elements], dtype=bool)
        self.outlasts = ~self.of_spring & lasting[self.element]
        self.drift_squared = np.array([drift_of(p) ** 2 for p in parameters])
        self.every = tuple(  # of all parameters, the actions' too: element, is_stiffness, estimated
            np.array(column)
            for column in zip(*((p.element, p.is_stiffness, p.coefficient.estimated) for p in structure.parameters))
        )
        self.noise = np.array([structure.bodies[k].noise or np.nan for k in structure.equations]) ** 2

    def make(
        self, motion: Motion, law: SpringLaw, theta: np.ndarray, variance: np.ndarray | float = 0.0
    ) -> tuple[Regression, Forces]:
        """theta (p,): the latest values, for what depends on them: the forces' change with errors of the motion;
        variance (p,) of each, for the same."""
        carries = np.where(self.outlasts, law.crushed[self.element], law.carries[self.element])
        lever = np.where(self.is_stiffness, law.lever[self.element], np.where(carries, motion.rate[self.element], 0.0))
        shift = law.shift
        if self.further is not None:
            lever, shift = self.further.lever(lever, motion, law), self.further.known(shift)
        factor = self._factor(motion)
        if factor is not None:
            lever, shift = np.where(self.of_spring, factor[self.element] * lever, lever), factor * shift
        forces = Forces(self.of_element * lever, shift)
        errors = MotionErrors(
            np.zeros((len(self.own_offset), len(self.velocity_variance), 3)),
            motion.sensors[1], motion.sensors[0] * motion.dt, self.velocity_variance, motion.time,
        )  # fmt: skip
        touched = self.estimated & carries
        active = touched & ~self._hidden(law, errors) if self.regressor_errors else touched
        known = self.share @ (forces.per_unit @ self.value + shift)
        measured = motion.measured
        if motion.applied is not None:
            lost = np.isnan(motion.applied)  # as where a measurement is
            known, measured = known + np.where(lost, 0.0, motion.applied), np.where(lost, np.nan, measured)
        gradient = np.where(touched, self.share @ forces.per_unit, 0.0)
        folds = np.abs(motion.rate) * motion.dt / np.maximum(np.abs(motion.crush), SHORTEST_CRUSH)
        walk = np.where(active & ~law.on_line[self.element], self.drift_squared * folds[self.element], 0.0)
        noise = np.maximum(np.where(np.isnan(self.noise), motion.noise, self.noise), QUIETEST**2)
        slopes = self._slopes(law, theta, factor)
        by_d, by_u = (-self.share @ (slope[:, None] * self.crush_of_body) for slope in slopes)
        likely = self._slopes(law, np.copysign(np.sqrt(theta**2 + variance), theta), factor)
        likely_d, likely_u = (-self.share @ (slope[:, None] * self.crush_of_body) for slope in likely)
        if self.actions is not None:
            static = np.where(self.of_spring, forces.per_unit, 0.0) @ theta[: len(lever)] + shift
            per_unit = self.actions.forces(motion, law, static)
            known, gradient, heavier = self.actions.added(known, gradient, motion, per_unit, slopes, theta)
            by_d, by_u, likely_d, likely_u = (heavier[:, None] * by for by in (by_d, by_u, likely_d, likely_u))
            active = np.concatenate([active, self.actions.estimated & (gradient[:, len(lever) :] != 0.0).any(axis=0)])
            walk = np.concatenate([walk, np.zeros(len(per_unit[0]))])
            forces = Forces(np.hstack([forces.per_unit, per_unit]), shift)
        return (
            Regression(
                known, gradient, measured, active, walk, noise, motion.dt, motion.time,
                self.own_offset + 0.5 * motion.time**2 * by_d + motion.time * by_u, motion.offset_variance,
                errors._replace(gradient=np.stack([self.own_offset, likely_u, likely_d], axis=-1))
                if self.regressor_errors else None,
            ),
            forces,
        )  # fmt: skip

    def _hidden(self, law: SpringLaw, errors: MotionErrors) -> np.ndarray:
        """(p,) Whether it is a stiffness whose crush is hidden in its own error."""
        return self.is_stiffness & (np.abs(law.lever) < HIDDEN * errors.of_crush(self.crush_of_body))[self.element]

    def corrected(self, motion: Motion, theta: np.ndarray, start: tuple[np.ndarray, np.ndarray]) -> Motion:
        """The motion without the errors of channels that are estimated; start: (b,) m and m/s at time zero."""
        return motion if self.actions is None else self.actions.corrected(motion, theta, start)

    def _factor(self, motion: Motion) -> np.ndarray | None:
        """(e,) what multiplies the static forces; None: nothing does."""
        if not self.factors:
            return None
        factor = np.ones(len(motion.rate))
        for k, of_rate in self.factors:
            factor[k] = of_rate(motion.rate[[k]])[0]
        return factor

    def _slopes(self, law: SpringLaw, theta: np.ndarray, factor: np.ndarray | None) -> np.ndarray:
        """(2, e) change of each element's force with its crush, N/m, and rate, N s/m."""
        slope = self.secant(theta, law.lever)
        unloading = self.unloading(theta)
        slope = np.where(law.on_line, self.known_unloading if unloading is None else unloading, slope)
        slope = slope if factor is None else factor * slope
        return np.where(law.carries, [slope, theta[self.damping_index]], 0.0)

    def inside(self, theta: np.ndarray, motion: Motion, peak: np.ndarray) -> np.ndarray | float:
        """(e,) N that effects add to the springs' own curves, by the latest theta; peak (e,) m before this sample."""
        return self.actions.inside(theta, motion, peak) if self.actions is not None else 0.0

    def secant(self, theta: np.ndarray, peak: np.ndarray) -> np.ndarray:
        """(e,) N/m: each element's stiffness, at the crush `peak` (e,) where it has higher powers."""
        stiffness = theta[self.stiffness_index]
        return stiffness if self.further is None else self.further.secant(stiffness, theta, peak)

    def unloading(self, theta: np.ndarray) -> np.ndarray | None:
        """(e,) N/m: the unloading slopes, where one is estimated."""
        return None if self.further is None else self.further.slope(theta)

    def status(self, law: SpringLaw, clamped: np.ndarray) -> np.ndarray:
        """(p,) ParameterStatus, uint8."""
        element, is_stiffness, estimated = self.every
        status = np.where(clamped, ParameterStatus.CLAMPED, ParameterStatus.ESTIMATED)
        status[law.on_line[element] & is_stiffness & ~clamped] = ParameterStatus.UNLOADING
        status[~law.carries[element] & (element >= 0)] = ParameterStatus.APART
        status[~estimated] = ParameterStatus.KNOWN
        return status.astype(np.uint8)
