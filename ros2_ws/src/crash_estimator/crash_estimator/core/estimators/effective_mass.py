"""Effective masses: the multipliers of the measured accelerations that balance them (thesis 4.4.1, 4.3a, 4.3b).

    with a measured barrier force F:    sum over bodies of M_k a_k = -F         (4.3a)
    without an external force:          sum over bodies of M_k a_k = 0,  sum of M_k = M_total    (4.3b)

F is the force on the barrier, so -F acts on the bodies. In 4.3b the last body's mass is what remains of the total,
M_n = M_total - sum of the others, which conserves it exactly:  sum over k < n of M_k (a_k - a_n) = -M_total a_n.

The masses are those of the bodies' accelerometers, which feel the structure's vibration too. Noise on a regressor
makes its coefficient too small; over `interval` the equation is one of impulse and momentum, and the vibration has
averaged out. With y = psi theta + e for these means, every interval counts alike:

    S = lambda S + psi' psi,   theta += S^-1 psi' (y - psi theta),   sigma^2 = mean e^2,   covariance = sigma^2 S^-1

RLS weighs by its running error covariance instead, here mostly that of the quiet first milliseconds. The masses
are constant (lambda = 1) unless told otherwise. `THESIS` is the thesis's "recursive least squares method", 5.3 on every
sample, with `weighted`:

    Lambda += gamma (e^2 - Lambda),    S = lambda S + psi' psi / Lambda,    theta += S^-1 psi' e / Lambda
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from crash_replay.recording import Sample, Test

from ..estimate import Description, Estimate, ParameterStatus, nothing_said
from ..kinematics import Kinematics, KinematicState, Motion
from ..regression import Regression
from ..structure import ModelError, Structure
from .update import Theta
from .window import Window, mean_of, widened

LEAST = 0.1
"""m/s^2: the model's masses count as one interval at this acceleration, so that S can be inverted from the first."""

THESIS = {"interval": 0.0, "weighted": True}
"""Settings of 5.3 as printed, on 4.3a or 4.3b."""


class MassState(NamedTuple):
    kinematics: KinematicState
    window: Window | None
    theta: np.ndarray  # (p,) kg
    information: np.ndarray  # (p, p) S, (m/s^2)^2
    squares: float  # sum of e^2 with forgetting, N^2
    counted: float  # intervals with forgetting
    error_variance: float  # Lambda, N^2; 1 where every interval counts alike
    gamma: float


class Balance(NamedTuple):
    """What is known of the balance after a sample."""

    covariance: np.ndarray  # (p, p) of theta
    variance: float  # of the mean force over an interval, N^2


@dataclass(frozen=True)
class MassSettings:
    """Settings of the method."""

    settings: Theta
    interval: float = 0.005  # s: of impulse and momentum; 0: every sample's forces
    forgetting: float = 1.0  # lambda, per interval
    weighted: bool = False  # an interval counts by the running error variance, as 5.3 prints it; else all alike


class EffectiveMass:
    """An estimator of the free bodies' masses; `init` and `step` as any other."""

    def __init__(self, structure: Structure, test: Test, settings: MassSettings):
        self.structure, self.settings = structure, settings
        self.free = [k for k, body in enumerate(structure.bodies) if body.free]
        self.names = [structure.bodies[k].name for k in self.free]
        self.barrier = next((row for row, k in enumerate(structure.equations) if structure.bodies[k].fixed), None)
        self._check()
        self.kinematics = Kinematics(structure, test)
        masses = np.array([structure.bodies[k].mass for k in self.free])
        self.total = float(masses.sum())
        n = len(masses)
        # M = back theta + constant: with a barrier theta is M, else the last mass is what remains
        self.back = np.eye(n) if self.barrier is not None else np.vstack([np.eye(n - 1), -np.ones(n - 1)])
        self.constant = masses * 0.0 if self.barrier is not None else np.eye(n)[-1] * self.total
        start = masses[: self.back.shape[1]]
        self.start = start
        self.description = Description(
            model=structure.name,
            method="effective_mass",
            parameters=tuple(f"{name}.mass" for name in self.names),
            parameter_units=("kg",) * n,
            equations=(
                "momentum" if self.barrier is None else structure.bodies[structure.equations[self.barrier]].name,
            ),
            equation_units=("N",),
            elements=(),
            between=(),
            bodies=tuple(body.name for body in structure.bodies),
            masses=tuple(body.mass or float("nan") for body in structure.bodies),
        )
        self.nothing = nothing_said(self.description)

    def _check(self) -> None:
        name = self.structure.name
        free = [self.structure.bodies[k] for k in self.free]
        silent = [body.name for body in free if not (body.acceleration and body.is_measured)]
        driven = [body.name for body in self.structure.bodies if body.driven]
        if silent or driven:
            what = (
                f"{silent[0]} has no acceleration channel" if silent else f"{driven[0]} is driven by an unknown force"
            )
            raise ModelError(f"model {name}: effective mass needs every force and acceleration, but body {what}")
        if self.barrier is None and (len(self.free) < 2 or any(body.fixed for body in self.structure.bodies)):
            raise ModelError(
                f"model {name}: effective mass needs a fixed body with a measured `force`, "
                "or two or more free bodies and nothing fixed"
            )

    def init(self) -> MassState:
        start = (LEAST * self.total) ** 2 if self.settings.weighted else 1.0
        empty = np.zeros((len(self.start),) * 2)
        return MassState(self.kinematics.init(), None, self.start, empty, 0.0, 0.0, start, 1.0)

    def step(self, state: MassState, sample: Sample) -> tuple[MassState, Estimate]:
        """Fold one sample in; `state` is left as it was."""
        kinematics, motion = self.kinematics.step(state.kinematics, sample)
        regression = self._regression(motion)
        after = state._replace(kinematics=kinematics)
        if motion.dt > 0.0 and not np.isnan(regression.measured).any():
            window = widened(state.window, regression)
            if window.duration >= self.settings.interval * (1.0 - 1e-6):
                after = self._updated(after, mean_of(window, regression))._replace(window=None)
            else:
                after = after._replace(window=window)
        return after, self._estimate(sample, motion, regression, state.theta, after)

    def _updated(self, state: MassState, mean: Regression) -> MassState:
        """One step of the recursion."""
        forgetting, psi = self.settings.forgetting, mean.gradient
        before = state.information if state.counted else LEAST**2 / state.error_variance * np.eye(len(self.start))
        innovation = mean.measured - psi @ state.theta
        gamma, scatter = 1.0 / (forgetting / state.gamma + 1.0), state.error_variance
        if self.settings.weighted:
            scatter += gamma * (float(innovation @ innovation) - scatter)
        information = forgetting * before + psi.T @ psi / scatter
        theta = state.theta + np.linalg.solve(information, psi.T @ innovation) / scatter
        squares = forgetting * state.squares + float(innovation @ (mean.measured - psi @ theta))
        return state._replace(
            theta=theta, information=information, squares=squares, counted=forgetting * state.counted + 1.0,
            error_variance=scatter, gamma=gamma,
        )  # fmt: skip

    def _balance(self, state: MassState) -> Balance:
        p = len(self.start)
        if state.counted <= p:
            return Balance(np.diag(self.start**2), 0.0)
        variance = state.squares / (state.counted - p)
        covariance = (1.0 if self.settings.weighted else variance) * np.linalg.inv(state.information)
        return Balance(0.5 * (covariance + covariance.T), variance)

    def _regression(self, motion: Motion) -> Regression:
        """The force on the barrier, or 0, as measured; -a as the masses' gradient. NaN in a dropout."""
        a = motion.acceleration[self.free]
        force = motion.measured[self.barrier] if self.barrier is not None else 0.0
        gradient = (-a @ self.back)[None, :]
        known = np.array([-a @ self.constant])
        measured = np.array([force if np.isfinite(a).all() else np.nan])
        active, nothing, unknown = np.ones(len(self.start), dtype=bool), np.zeros(len(self.start)), np.full(1, np.nan)
        return Regression(known, np.nan_to_num(gradient), measured, active, nothing, unknown, motion.dt, motion.time)

    def _estimate(
        self, sample: Sample, motion: Motion, regression: Regression, before: np.ndarray, after: MassState
    ) -> Estimate:
        psi, balance = regression.gradient, self._balance(after)
        predicted = regression.known + psi @ after.theta
        innovation_covariance = balance.variance + psi @ balance.covariance @ psi.T
        return self.nothing._replace(
            number=sample.number,
            time_ns=sample.time_ns,
            parameters=self.back @ after.theta + self.constant,
            covariance=self.back @ balance.covariance @ self.back.T,
            status=np.full(len(self.free), ParameterStatus.ESTIMATED, dtype=np.uint8),
            measured=regression.measured,
            predicted=predicted,
            innovation=regression.measured - regression.known - psi @ before,
            innovation_covariance=innovation_covariance,
            residual=regression.measured - predicted,
            residual_std=np.full(1, np.sqrt(balance.variance)),
            displacement=motion.displacement,
            velocity=motion.velocity,
            acceleration=motion.acceleration,
        )


def with_effective_masses(structure: Structure, masses: dict[str, float]) -> Structure:
    """The structure with the masses found, as a first stage for the other methods; keys "car.mass" or "car"."""
    found = {name.removesuffix(".mass"): mass for name, mass in masses.items()}
    for name, mass in found.items():
        if not mass > 0.0:
            raise ModelError(
                f"model {structure.name}: the effective mass of {name} came out as {mass:.4g} kg, not above 0"
            )
    bodies = tuple(replace(body, mass=found.get(body.name, body.mass)) for body in structure.bodies)
    return replace(structure, bodies=bodies)
