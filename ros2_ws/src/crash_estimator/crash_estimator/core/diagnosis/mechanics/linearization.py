"""The equations of motion along a trajectory: what they miss (defect), and how motion and parameters change them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..observation.record import ObservedRecord
from ..observation.trajectory import Trajectory, crush_and_rate
from ..parameterization.layout import DRIVEN, FREE, Experiment
from ..parameterization.terms import Link
from .driven_motion import driven_by, start_by
from .linear_system import Linear, Sampling, ranked
from .link_force import LinkForce, link_force
from .masses import body_loads, mass_shares, masses, measured_inertia
from .outputs import sampling


class Equations(NamedTuple):
    """One experiment's equations at a trajectory."""

    linear: Linear
    sampling: Sampling
    rows: np.ndarray  # (g, b) acceleration of free and driven bodies, force on fixed ones, as the forces give them
    columns: np.ndarray  # parameter of each column after the first, (columns - 1,); of knots only those in use
    links: list[LinkForce]


class Observer(NamedTuple):
    """What draws free bodies towards a motion: - rate^2 (x - x_target) - 2 rate (v - v_target), critically damped."""

    rate: float  # 1/s
    target: Trajectory

    def acceleration(self, trajectory: Trajectory) -> np.ndarray:
        """(g, b) m/s^2, away from the target."""
        x, v = trajectory.x - self.target.x, trajectory.v - self.target.v
        return self.rate**2 * x + 2.0 * self.rate * v


class OtherLaw(NamedTuple):
    """A law for a link of the layout that is only tried out."""

    link: Link  # whose last term's coefficient is the parameter after the layout's last
    value: float  # of that coefficient


class _Actions:
    """External accelerations and forces per unit of a parameter, column by column."""

    def __init__(self, inverse_mass: np.ndarray):
        self.inverse_mass = inverse_mass
        self.columns: dict[int, int] = {}  # by parameter
        self.acting: list[tuple[int, int, np.ndarray]] = []

    def act(self, parameter: int, body: int, values: np.ndarray) -> None:
        self.acting.append((self.columns.setdefault(parameter, 1 + len(self.columns)), body, values))

    def push(self, parameter: int, ends: tuple[int, int], force: np.ndarray) -> None:
        for k, sign in zip(ends, (-1.0, 1.0), strict=True):
            if self.inverse_mass[k]:
                self.act(parameter, k, sign * self.inverse_mass[k] * force)


def linearise(
    experiment: Experiment, theta: np.ndarray, trajectory: Trajectory, others: Sequence[OtherLaw] = (),
    observer: Observer | None = None, contact_ramp: float = 1.0,
) -> Equations:  # fmt: skip
    """Forces and derivatives along a trajectory whose driven bodies already move as theta says.

    others: other laws for links of the layout; each gives one more column, numbered from layout.size on, the change of
    force when that law takes the place of the present one. contact_ramp: steps of time in which contact opens and
    closes.
    """
    layout, record, r = experiment
    free, driven = layout.kind == FREE, layout.kind == DRIVEN
    measured = np.zeros(len(layout.bodies))
    measured[[output.body for output in layout.outputs if output.fixed]] = 1.0
    inverse = np.where(free, 1.0 / masses(layout, theta), measured)
    actions = _Actions(inverse)
    loads, forces = _link_forces(experiment, theta, trajectory, others, contact_ramp, actions)
    for term, k, force, by_shapes in body_loads(layout, theta, record, measured_inertia(layout, record, trajectory)):
        c = float(theta[term.coefficient])
        loads[:, k] += c * force
        actions.act(term.coefficient, k, inverse[k] * force)
        for parameter, column in zip(term.shapes.values(), by_shapes, strict=True):
            actions.act(parameter, k, inverse[k] * c * column)
    for k, modes in layout.pushes[r].items():
        courses = record.cosines[:, : len(modes)]
        loads[:, k] += record.signals[layout.structure.bodies[k].applied].on_grid + courses @ theta[modes]
        for parameter, course in zip(modes, courses.T, strict=True):
            actions.act(parameter, k, inverse[k] * course)
    rows = loads * inverse
    rows[:, driven] = trajectory.a[:, driven]
    for k, parameter in layout.kicks[r].items():
        rows[:, k] += theta[parameter] * record.kick
        actions.act(parameter, k, record.kick)
    for k, parameter, share in mass_shares(layout):
        actions.act(parameter, k, -share * inverse[k] * rows[:, k])
    for k, parameter, column in driven_by(experiment, theta):
        actions.act(parameter, k, column)
    sampled, of_outputs = sampling(experiment, theta)
    zeros = [*(layout.offsets[r] + q for q in range(len(layout.outputs))), *layout.drifts[r].values()]
    for parameter in [*of_outputs, *zeros]:
        actions.columns.setdefault(parameter, 1 + len(actions.columns))
    defect = rows.copy()
    defect[:, free] -= trajectory.a[:, free]
    if observer:
        defect[:, free] -= observer.acceleration(trajectory)[:, free]
    for own in np.flatnonzero(~driven).tolist():
        actions.acting.append((0, own, defect[:, own]))
    starts = {actions.columns.setdefault(p, 1 + len(actions.columns)): s for p, s in start_by(experiment)}
    linear, knots = _linear_system(experiment, forces, actions, starts, observer.rate if observer else 0.0)
    every = np.concatenate([np.array(list(actions.columns), dtype=int), knots])
    return Equations(linear, sampled, rows, every, forces)


def force_along(element: str, experiment: Experiment, theta: np.ndarray, trajectory: Trajectory) -> np.ndarray:
    """(g,) N of an element along a motion."""
    link = experiment.layout.link(element)
    motion = _crush_and_rate(link, experiment, trajectory)
    return link_force(link, theta, experiment.record.time, _steps(experiment.record), *motion).force


def _link_forces(
    experiment: Experiment, theta: np.ndarray, trajectory: Trajectory, others: Sequence[OtherLaw], contact_ramp: float,
    actions: _Actions,
) -> tuple[np.ndarray, list[LinkForce]]:  # fmt: skip
    """(g, b) N that the links push the bodies with, and the links' forces one by one."""
    layout, record, _ = experiment
    loads, forces = np.zeros(trajectory.a.T.shape).T, []
    steps = contact_ramp * _steps(record)
    for link in layout.links:
        found = link_force(link, theta, record.time, steps, *_crush_and_rate(link, experiment, trajectory))
        a, c = link.ends
        loads[:, a] -= found.force
        loads[:, c] += found.force
        for parameter, column in zip(found.parameters, found.columns, strict=True):
            actions.push(parameter, link.ends, column)
        forces.append(found)
    present = {link.name: found for link, found in zip(layout.links, forces, strict=True)}
    for j, (link, value) in enumerate(others):
        motion = _crush_and_rate(link, experiment, trajectory)
        other = link_force(_acting(link, theta), np.append(theta, value), record.time, steps, *motion)
        actions.push(layout.size + j, link.ends, other.force - present[link.name].force)
    return loads, forces


def _linear_system(
    experiment: Experiment, forces: Sequence[LinkForce], actions: _Actions, starts: Mapping[int, np.ndarray],
    observer_rate: float,
) -> tuple[Linear, np.ndarray]:  # fmt: skip
    """For the compiled passes; and the knots' parameters, in the order of their columns. starts: by column, (2, b)."""
    layout, record, _ = experiment
    g, n = len(record.time), len(forces)
    column, body, acts = (np.array(each) for each in zip(*actions.acting, strict=True))
    slopes = np.array([(f.kx, f.kv, f.kp) for f in forces], float).reshape(n, 3, g).transpose(1, 0, 2)
    kx, kv, kp = np.ascontiguousarray(slopes)  # as one link's are already: for two layouts all would be compiled twice
    memories = [memory for f in forces for memory in f.memories]
    peaks = [f.loading & f.kp.any() for f in forces]  # none is kept that nothing hangs on
    knot, order, touched = ranked(np.array([f.knot for f in forces], np.int64).reshape(n, g, 2), layout.knots)
    start = np.zeros((2, len(layout.bodies), 1 + len(actions.columns)))
    for k, change in starts.items():
        start[:, :, k] = change
    changed = np.ones(g, bool)
    changed[1:] = (kx[:, 1:] != kx[:, :-1]).any(axis=0) | (kv[:, 1:] != kv[:, :-1]).any(axis=0)
    changed[1:] |= np.abs(record.dt[1:] - record.dt[:-1]) > 1e-9 * record.step
    return Linear(
        dt=record.dt,
        ends=np.array([link.ends for link in layout.links]).reshape(-1, 2),
        crush_ends=np.array([link.crush_ends for link in layout.links]).reshape(-1, 2),
        inverse_mass=actions.inverse_mass,
        kind=layout.kind,
        kx=kx,
        kv=kv,
        kp=kp,
        loading=np.array(peaks, bool).reshape(n, g),
        knot=knot,
        weight=np.array([f.weight for f in forces], float).reshape(n, g, 2),
        changed=changed,
        start=start,
        observer=observer_rate,
        others=1 + len(actions.columns),
        column=column,
        body=body,
        acts=acts,
        remembers=np.array([k for k, f in enumerate(forces) for _ in f.memories], np.int64),
        kept=_stacked([m.kept for m in memories], g),
        by_crush=_stacked([m.by_crush for m in memories], g),
        by_before=_stacked([m.by_before for m in memories], g),
        recalled=_stacked([m.force for m in memories], g),
        touched=touched,
    ), order


def _stacked(rows: Sequence[np.ndarray], g: int) -> np.ndarray:
    return np.array(rows, float).reshape(len(rows), g)


def _acting(link: Link, theta: np.ndarray) -> Link:
    """Without effects that are at nothing: where only the force counts, their derivatives are work for nothing."""
    return replace(link, terms=tuple(t for t in link.terms if t in link.in_law or theta[t.coefficient]))


def _steps(record: ObservedRecord) -> np.ndarray:
    """(g,) length of the step that an instant stands for."""
    return np.maximum(record.dt, record.dt[1])


def _crush_and_rate(link: Link, experiment: Experiment, trajectory: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    crush, rate = crush_and_rate(experiment.record, trajectory, link.crush_ends, link.displacement, link.velocity)
    return crush - (link.origin[experiment.index] if link.origin else 0.0), rate
