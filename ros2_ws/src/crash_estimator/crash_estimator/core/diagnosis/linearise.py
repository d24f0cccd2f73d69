"""The equations of motion along a trajectory: what they miss (defect), and how motion and parameters change them."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from crash_replay.conditioning import cfc_filter

from ..effects.base import AttachedBody, BodyForce, BodyInertia
from .layout import Layout, Link, Place
from .linear import Linear, Sampling, ranked
from .linkforce import LinkForce, link_force
from .motion import distortion, driven_by, measured_motion
from .propagate import DRIVEN, FREE
from .records import Record
from .temper import CFC, SLOWEST
from .trajectory import Trajectory, measured_crush


class Equations(NamedTuple):
    """One record's equations at a trajectory."""

    linear: Linear
    sampling: Sampling
    rows: np.ndarray  # (g, b) acceleration of free and driven bodies, force on fixed ones, as the forces give them
    columns: np.ndarray  # parameter of each column after the first, (columns - 1,); of knots only those in use
    links: list[LinkForce]


def linearise(
    layout: Layout, record: Record, r: int, theta: np.ndarray, trajectory: Trajectory, switched: Sequence[Link] = (),
    pull: float = 0.0, target: Trajectory | None = None, blur: float = 1.0,
) -> Equations:  # fmt: skip
    """Forces and derivatives along a trajectory whose driven bodies already move as theta says.

    switched: other laws for links of the layout, by name; each gives one more column, numbered from layout.size
    on, the change of force when that law takes the place of the present one. pull (1/s): of an observer
    towards the motion `target`; blur: steps of time in which contact opens and closes.
    """
    g, bodies = trajectory.a.shape
    mass = _masses(layout, theta)
    measured = np.array([_measured(layout, body) for body in range(bodies)], dtype=float)
    inverse = np.where(layout.kind == FREE, 1.0 / mass, measured)
    inverse[layout.kind == DRIVEN] = 0.0
    driven = layout.kind == DRIVEN
    columns: dict[int, int] = {}  # by parameter
    acting: list[tuple[int, int, np.ndarray]] = []

    def act(parameter: int, body: int, values: np.ndarray) -> None:
        acting.append((columns.setdefault(parameter, 1 + len(columns)), body, values))

    def push(parameter: int, ends: tuple[int, int], force: np.ndarray) -> None:
        for k, sign in zip(ends, (-1.0, 1.0)):
            if inverse[k]:
                act(parameter, k, sign * inverse[k] * force)

    loads, forces, steps = np.zeros((bodies, g)).T, [], blur * _steps(record)
    for link in layout.links:
        crush, rate = _motion(link, record, r, trajectory)
        found = link_force(link, theta, record.time, steps, crush, rate)
        a, c = link.ends
        loads[:, a] -= found.force
        loads[:, c] += found.force
        for parameter, column in zip(found.parameters, found.columns):
            push(parameter, link.ends, column)
        forces.append(found)
    numbers = {link.name: i for i, link in enumerate(layout.links)}
    for j, link in enumerate(switched):
        present = forces[numbers[link.name]]
        crush, rate = _motion(link, record, r, trajectory)
        tried = np.append(theta, link.trial)
        other = link_force(_acting(link, theta), tried, record.time, steps, crush, rate)
        push(layout.size + j, link.ends, other.force - present.force)
    for place in layout.places:
        _body_effect(layout, record, place, theta, trajectory, loads, act, inverse)
    rows = loads * inverse
    rows[:, driven] = trajectory.a[:, driven]
    for place in layout.places:
        addition = place.addition
        inertia = addition.target if isinstance(addition.effect, BodyInertia) else None
        if inertia is not None:
            k = layout.structure.body_index[inertia]
            act(place.coefficient, k, -inverse[k] * rows[:, k])
        if isinstance(addition.effect, AttachedBody) and addition.taken_from:
            k = layout.structure.body_index[addition.taken_from]
            act(place.coefficient, k, inverse[k] * rows[:, k])
    for k, parameter, column in driven_by(layout, record, r, theta):
        act(parameter, k, column)
    sampling, outputs = _sampling(layout, record, theta)
    for parameter in [*outputs, *(layout.offsets[r] + q for q in range(len(layout.outputs)))]:
        columns.setdefault(parameter, 1 + len(columns))
    defect = rows.copy()
    free = layout.kind == FREE
    defect[:, free] -= trajectory.a[:, free]
    if pull:
        x, v = trajectory.x - target.x, trajectory.v - target.v
        defect[:, free] -= pull**2 * x[:, free] + 2.0 * pull * v[:, free]
    acting += [(0, int(k), defect[:, k]) for k in np.flatnonzero(~driven)]
    ends = np.array([link.ends for link in layout.links]).reshape(-1, 2)
    crush_ends = np.array([link.crush_ends for link in layout.links]).reshape(-1, 2)
    column, body, acts = (np.array(each) for each in zip(*acting))
    n = len(forces)
    slopes = np.array([(f.kx, f.kv, f.kp) for f in forces], float).reshape(n, 3, g).transpose(1, 0, 2)
    kx, kv, kp = np.ascontiguousarray(slopes)  # as one link's are already: for two layouts all would be compiled twice
    peaks = [f.loading & f.kp.any() for f in forces]  # none is kept that nothing hangs on
    loading = np.array(peaks, bool).reshape(n, g)
    weight = np.array([f.weight for f in forces], float).reshape(n, g, 2)
    knot, order, touched = ranked(np.array([f.knot for f in forces], np.int64).reshape(n, g, 2), layout.knots)
    changed = np.ones(g, bool)
    changed[1:] = (np.diff(kx) != 0.0).any(axis=0) | (np.diff(kv) != 0.0).any(axis=0)
    changed[1:] |= np.abs(np.diff(record.dt)) > 1e-9 * record.step
    linear = Linear(
        record.dt, ends, crush_ends, inverse, layout.kind, kx, kv, kp, loading, knot, weight, changed, pull,
        1 + len(columns), column, body, acts, touched,
    )  # fmt: skip
    every = np.concatenate([np.array(list(columns), dtype=int), order])
    return Equations(linear, sampling, rows, every, forces)


def _acting(link: Link, theta: np.ndarray) -> Link:
    """Without effects that are at nothing: where only the force counts, their derivatives are work for nothing."""
    forces, factors = (tuple(p for p in places if theta[p.coefficient]) for places in (link.forces, link.factors))
    return replace(link, forces=forces, factors=factors)


def _steps(record: Record) -> np.ndarray:
    """(g,) length of the step that an instant stands for."""
    return np.maximum(record.dt, record.dt[1] if len(record.dt) > 1 else 1e-4)


def _measured(layout: Layout, body: int) -> bool:
    return any(output.body == body and output.fixed for output in layout.outputs)


def _masses(layout: Layout, theta: np.ndarray) -> np.ndarray:
    mass = np.array([body.mass or 1.0 for body in layout.structure.bodies] + [1.0] * len(layout.attached))
    for place in layout.places:
        addition = place.addition
        if isinstance(addition.effect, BodyInertia):
            mass[layout.structure.body_index[addition.target]] += theta[place.coefficient]
        if isinstance(addition.effect, AttachedBody) and addition.taken_from:
            mass[layout.structure.body_index[addition.taken_from]] -= theta[place.coefficient]
    return mass


def _motion(link, record: Record, r: int, trajectory: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    if link.displacement:
        return measured_crush(record, link.displacement, link.velocity)
    a, b = link.crush_ends
    origin = link.origin[r] if link.origin else 0.0
    return trajectory.x[:, a] - trajectory.x[:, b] - origin, trajectory.v[:, a] - trajectory.v[:, b]


def _body_effect(layout, record, place: Place, theta, trajectory, loads, act, inverse) -> None:
    """Forces that act on one body: constant ones, and an attached body's inertia."""
    addition, c = place.addition, float(theta[place.coefficient])
    if isinstance(addition.effect, BodyForce):
        k, force = layout.structure.body_index[addition.target], addition.effect.force(record.time)
    elif isinstance(addition.effect, AttachedBody):
        a = trajectory.a[:, layout.attached[addition.target]]
        k, force = layout.structure.body_index[addition.host], -_rigid(record, a)
    else:
        return
    loads[:, k] += c * force
    act(place.coefficient, k, inverse[k] * force)


def _rigid(record: Record, a: np.ndarray) -> np.ndarray:
    """(g,) the acceleration that acts as inertia; where noise stands for what is left of a structure that rings
    (`mix`), its ringing is none: what counts is the band in which such outputs are compared."""
    step = float(record.dt[-1])
    return a if record.mix is None or step * SLOWEST > 1.0 else cfc_filter(a, step, CFC)


class Noise(NamedTuple):
    """Of one sample of each output, and how it grows with parameters: through the masses whose inertia is measured."""

    std: np.ndarray  # (q,) SI
    growth: list[tuple[int, int, float]]  # output, parameter, d ln(std) / d parameter


def output_noise(layout: Layout, record: Record, theta: np.ndarray, samples: int = 1) -> Noise:
    """An attached body's inertia is felt with the noise of its channel: var_q = sigma_q^2 + (m / M)^2 sigma_a^2 s.

    s = 1, or less for means over some samples of an output that a delay of a fraction f of the period smooths:
    1 - 2 f (1 - f) / samples. In noise that is as large as what residuals leave (`mix`), a sensor's is contained.
    """
    variance, growth = record.noise**2, []
    places = [place for place in layout.places if isinstance(place.addition.effect, AttachedBody)]
    if record.mix is not None or not places:
        return Noise(record.noise, growth)
    mass, index = _masses(layout, theta), layout.structure.body_index
    period = record.period
    for place in places:
        addition = place.addition
        host, sigma = index[addition.host], record.signals[addition.target].noise
        share = float(theta[place.coefficient]) / mass[host]
        slope = (1.0 + (share if addition.taken_from == addition.host else 0.0)) / mass[host]
        for q, output in enumerate(layout.outputs):
            if output.body != host:
                continue
            delay, parameter = _delay(layout, theta, output.channel)
            f = delay / period % 1.0
            smoothed = 1.0 - 2.0 * f * (1.0 - f) / samples
            variance[q] += (share * sigma) ** 2 * smoothed
            growth.append((q, place.coefficient, share * slope * sigma**2 * smoothed))
            if parameter >= 0:
                growth.append((q, parameter, (share * sigma) ** 2 * (2.0 * f - 1.0) / (samples * period)))
    return Noise(np.sqrt(variance), [(q, p, g / variance[q]) for q, p, g in growth])


def _delay(layout: Layout, theta: np.ndarray, channel: str) -> tuple[float, int]:
    found = distortion(layout, theta, channel)
    return found.delay, found.parameters[1]


def _sampling(layout: Layout, record: Record, theta: np.ndarray) -> tuple[Sampling, list[int]]:
    """How rows become outputs, and the parameters that act on outputs only."""
    step = record.step
    found = [distortion(layout, theta, output.channel) for output in layout.outputs]
    lag = np.array([d.delay / step for d in found])
    parameters = [p for d in found for p in d.parameters if p >= 0]
    sampling = Sampling(
        body=np.array([output.body for output in layout.outputs]),
        gain=np.array([1.0 + d.gain for d in found]),
        lag=np.floor(lag).astype(int),
        fraction=lag - np.floor(lag),
        bin=record.bin,
        weight=record.valid / output_noise(layout, record, theta, record.per_bin).std,
    )
    return sampling, parameters


def predicted(layout: Layout, record: Record, r: int, theta: np.ndarray, rows: np.ndarray):
    """(g, q) outputs that rows (g, b) give, and the columns of what acts on outputs only: (q, parameter, (g,))."""
    outputs, by = np.zeros((len(record.time), len(layout.outputs))), []
    step = record.step
    for q, output in enumerate(layout.outputs):
        d = distortion(layout, theta, output.channel)
        lag = d.delay / step
        whole, fraction = int(np.floor(lag)), lag - np.floor(lag)
        true = (1.0 - fraction) * _later(rows[:, output.body], whole)
        if fraction:
            true += fraction * _later(rows[:, output.body], whole + 1)
            true[whole : whole + 1] = 0.0  # still an instant before the impact
        offset = layout.offsets[r] + q
        outputs[:, q] = (1.0 + d.gain) * true + d.offset + theta[offset]
        by.append((q, offset, np.ones(len(true))))
        gain, delay, jump = d.parameters
        if gain >= 0:
            by.append((q, gain, true))
        if jump >= 0:
            by.append((q, jump, np.ones(len(true))))
        if delay >= 0:
            slope = (_later(rows[:, output.body], whole + 1) - _later(rows[:, output.body], whole)) / step
            slope[whole : whole + 1] *= fraction == 0.0
            by.append((q, delay, (1.0 + d.gain) * slope))
    return outputs, by


def _later(values: np.ndarray, steps: int) -> np.ndarray:
    return values if not steps else np.concatenate([np.zeros(steps), values[: len(values) - steps]])


def balance_of(layout: Layout, record: Record, theta: np.ndarray) -> np.ndarray:
    """(g,) N: the force on a fixed body that the measured accelerations of all masses call for, - sum of M a."""
    motion = measured_motion(layout, record, 0, np.where(np.arange(layout.size) < layout.common, theta, 0.0))
    mass = _masses(layout, theta)
    force = np.zeros(len(record.time))
    for k, body in enumerate(layout.structure.bodies):
        if body.free:
            force -= mass[k] * motion.a[:, k]
    for place in layout.places:
        if isinstance(place.addition.effect, AttachedBody):
            force -= theta[place.coefficient] * motion.a[:, layout.attached[place.addition.target]]
        if isinstance(place.addition.effect, BodyForce):
            force += theta[place.coefficient] * place.addition.effect.force(record.time)
    return force
