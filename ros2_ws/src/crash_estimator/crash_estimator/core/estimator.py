"""One estimator: motion -> contact -> regression -> method, sample by sample.

`step` is pure: it takes the state after the last sample and returns a new one, so that the same fold runs
in a node, offline, and again from any sample whose state was kept.
"""

from typing import Any, NamedTuple, Protocol

import numpy as np

from crash_replay.recording import Sample, Test

from .contact import Contact, ContactState
from .estimate import Description, Estimate, Event
from .estimators.update import Update
from .kinematics import Kinematics, KinematicState, Motion
from .regression import Forces, Regression, Regressor
from .structure import Structure


class Method(Protocol):
    """A recursive estimation method: frozen settings, `init`, `update`.

    One with a setting `regressor_errors` that is false gets a regression whose motion is taken as true.
    """

    @property
    def settings(self) -> Any: ...  # of the parameters

    def init(self, equations: int): ...

    def update(self, state, regression: Regression) -> tuple[object, Update]: ...


class State(NamedTuple):
    """Everything an estimator knows after a sample."""

    kinematics: KinematicState
    contact: ContactState
    method: object
    update: Update  # the last one
    dropped: tuple[int, ...]  # equations without a valid measurement at the last sample


class Estimator:
    """Settings: a structure fitted to a test's channels, and a method."""

    def __init__(self, structure: Structure, test: Test, method: Method, method_name: str):
        self.kinematics = Kinematics(structure, test)
        self.contact = Contact(structure)
        self.regressor = Regressor(structure, getattr(method, "regressor_errors", True))
        self.start = self.kinematics.initial_displacement, self.kinematics.initial_velocity
        self.structure = structure
        self.method = method
        parameters, extra = structure.parameters, self._extra_names()
        self.description = Description(
            model=structure.name,
            method=method_name,
            parameters=tuple(p.name for p in parameters),
            parameter_units=tuple(p.unit for p in parameters),
            equations=tuple(structure.bodies[k].name for k in structure.equations),
            equation_units=structure.equation_units,
            elements=tuple(e.name for e in structure.elements),
            between=tuple(e.between for e in structure.elements),
            bodies=tuple(b.name for b in structure.bodies),
            masses=tuple(b.mass or float("nan") for b in structure.bodies),
            extra=tuple(extra),
            extra_units=tuple(extra.values()),
        )

    def _extra_names(self) -> dict[str, str]:
        """Name -> unit of what the method knows besides the parameters, such as a noise model; most methods nothing."""
        names = getattr(self.method, "extra_names", None)
        return names(tuple(self.structure.bodies[k].name for k in self.structure.equations)) if names else {}

    def init(self) -> State:
        p, q = len(self.description.parameters), len(self.description.equations)
        settings = self.method.settings
        start = Update(settings.initial, np.diag(settings.std**2), np.zeros((q, q)), np.zeros(p, dtype=bool))
        return State(self.kinematics.init(), self.contact.init(), self.method.init(q), start, ())

    def step(self, state: State, sample: Sample) -> tuple[State, Estimate]:
        """Fold one sample in; `state` is left as it was."""
        kinematics, motion = self.kinematics.step(state.kinematics, sample)
        motion = self.regressor.corrected(motion, state.update.theta, self.start)
        stiffness = self.regressor.secant(state.update.theta, state.contact.peak_crush)
        unloading = self.regressor.unloading(state.update.theta)
        damping = state.update.theta[self.regressor.damping_index]
        inside = self.regressor.inside(state.update.theta, motion, state.contact.peak_crush)
        contact, law, events = self.contact.step(state.contact, motion, stiffness, unloading, damping, inside)
        regression, forces = self.regressor.make(motion, law, state.update.theta, np.diagonal(state.update.stated))
        method, update = state.method, state.update
        if motion.dt > 0.0 and self._excited(regression):
            method, update = self.method.update(method, regression)
            events += update.events + self._clamp_events(state.update.clamped, update)
        else:
            update = update._replace(
                clamped=np.zeros_like(update.clamped), innovation_covariance=np.diag(np.nan_to_num(regression.noise)),
                events=(), expected_error=(0.0, 0.0), residual_variance=regression.noise,
            )  # fmt: skip
        dropped, drop_events = self._dropouts(state.dropped, motion)
        status = self.regressor.status(law, update.clamped)
        estimate = self._estimate(
            sample, motion, contact, regression, state.update.theta, update, forces, status, events + drop_events
        )
        return State(kinematics, contact, method, update, dropped), estimate

    @staticmethod
    def _excited(regression: Regression) -> bool:
        measured = ~np.isnan(regression.measured)
        return bool((regression.gradient[measured][:, regression.active] != 0.0).any())

    def _clamp_events(self, before: np.ndarray, update: Update) -> tuple[Event, ...]:
        fresh = np.flatnonzero(update.clamped & ~before)
        names = self.description.parameters
        return tuple(
            Event("clamped", names[k], float(update.theta[k]), f"{names[k]}: held at its bound {update.theta[k]:g}")
            for k in fresh
        )

    def _dropouts(self, before: tuple[int, ...], motion: Motion) -> tuple[tuple[int, ...], tuple[Event, ...]]:
        now = tuple(np.flatnonzero(np.isnan(motion.measured)).tolist())
        names = self.description.equations
        return now, tuple(
            Event("dropout", names[k], motion.time, f"{names[k]}: no valid measurement, its equation is left out")
            for k in now
            if k not in before
        )

    def _estimate(  # noqa: PLR0913 - all that a sample's Estimate is made of
        self,
        sample: Sample,
        motion: Motion,
        contact: ContactState,
        regression: Regression,
        theta_before: np.ndarray,
        update: Update,
        forces: Forces,
        status: np.ndarray,
        events: tuple[Event, ...],
    ) -> Estimate:
        unknown = (float("nan"),) * len(self.description.extra)
        predicted = regression.known + regression.gradient @ update.theta + update.expected_error[1]
        before = regression.known + regression.gradient @ theta_before + update.expected_error[0]
        left = update.residual_variance
        left = np.diagonal(update.innovation_covariance) if left is None else left
        covariance = update.stated
        return Estimate(
            number=sample.number,
            time_ns=sample.time_ns,
            parameters=update.theta,
            covariance=covariance,
            status=status,
            measured=motion.measured,
            predicted=predicted,
            innovation=motion.measured - before,
            innovation_covariance=update.innovation_covariance,
            residual=motion.measured - predicted,
            residual_std=np.sqrt(np.maximum(left, 0.0)),
            crush=motion.crush,
            rate=motion.rate,
            force=forces.per_unit @ update.theta + forces.shift,
            force_std=np.sqrt(np.einsum("ep,pr,er->e", forces.per_unit, covariance, forces.per_unit)),
            state=contact.state,
            displacement=motion.displacement,
            velocity=motion.velocity,
            acceleration=motion.acceleration,
            events=events,
            extra=update.extra or unknown,
            extra_std=update.extra_std or unknown,
        )
