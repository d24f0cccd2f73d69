"""Masses as the parameters make them, and forces on single bodies."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from crash_replay.conditioning import cfc_filter

from ..observation.noise_inflation import CFC, SLOWEST
from ..observation.record import ObservedRecord
from ..observation.trajectory import Trajectory
from ..parameterization.layout import Experiment, Layout
from ..parameterization.terms import Term
from .driven_motion import measured_motion


def masses(layout: Layout, theta: np.ndarray) -> np.ndarray:
    """(b,) kg; 1 of a body without one."""
    mass = np.ones(len(layout.bodies))
    for k, body in enumerate(layout.structure.bodies):
        mass[k] = body.mass or 1.0
    for k, parameter, share in mass_shares(layout):
        mass[k] += share * theta[parameter]
    return mass


def mass_shares(layout: Layout) -> Iterator[tuple[int, int, float]]:
    """(body, parameter, kg for one unit of it)."""
    for k, parameter in layout.weighed.items():
        yield k, parameter, layout.structure.bodies[k].mass
    for term in layout.terms:
        for name, share in term.addition.effect.mass_shares(term.addition).items():
            yield layout.structure.body_index[name], term.coefficient, share


class BodyLoad(NamedTuple):
    """An external force, or an attached body's inertia, for one unit of its coefficient."""

    term: Term
    body: int
    force: np.ndarray  # (g,) N
    by_shapes: list[np.ndarray]  # (g,) N by the logarithm of each shape constant


def body_loads(
    layout: Layout, theta: np.ndarray, record: ObservedRecord, inertial: Callable[[str], np.ndarray]
) -> Iterator[BodyLoad]:
    for term in layout.terms:
        load = partial(term.addition.effect.body_load, term.addition, layout.structure, record.time, inertial)
        found = load(**term.shapes_at(theta))
        if found is not None:
            body, force = found
            by_shapes = term.by_shapes(theta, force, lambda load=load, **shapes: load(**shapes)[1])
            yield BodyLoad(term, layout.structure.body_index[body], force, by_shapes)


def measured_inertia(layout: Layout, record: ObservedRecord, trajectory: Trajectory) -> Callable[[str], np.ndarray]:
    """Acceleration (g,) of what acts as inertia: an attached body's by its channel, else as that was measured, or as a
    body's own channels were.

    Where noise stands for what is left of a structure that rings, its ringing is none: what counts is the band in
    which such outputs are compared.
    """
    step, index = float(record.dt[-1]), layout.structure.body_index
    rigid = record.noise_is_inflated and step * SLOWEST <= 1.0

    def inertial(name: str) -> np.ndarray:
        channels = layout.structure.bodies[index[name]].acceleration if name in index else (name,)
        attached = layout.attached.get(name)
        if attached is None:
            a = np.mean([record.signals[one].on_grid for one in channels], axis=0)
        else:
            a = trajectory.a[:, attached]
        return cfc_filter(a, step, CFC) if rigid else a

    return inertial


def balance_of(experiment: Experiment, theta: np.ndarray) -> np.ndarray:
    """(g,) N: the force on a fixed body that the measured accelerations of all masses call for, - sum of M a."""
    layout, record, _ = experiment
    common = np.where(np.arange(layout.size) < layout.common, theta, 0.0)
    motion = measured_motion(experiment, common)
    mass = masses(layout, theta)
    force = np.zeros(len(record.time))
    for k, body in enumerate(layout.structure.bodies):
        if body.free:
            force -= mass[k] * motion.a[:, k]
        if body.applied:
            force += record.signals[body.applied].on_grid
    moving = layout.structure.body_index | layout.attached
    for load in body_loads(layout, theta, record, lambda name: motion.a[:, moving[name]]):
        force += theta[load.term.coefficient] * load.force
    return force
