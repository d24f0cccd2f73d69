"""Free run: the model simulated from its initial velocities with the estimated characteristics (thesis 4.5, 6.4.4).

    M_k a_k = sum over elements of delta_k F(X, V),    4th-order Runge-Kutta, nothing corrected on the way

Driven bodies move as their channels say; elements whose crush is a channel follow it. What an estimator followed
sample by sample need not hold here: errors of the force add up in velocity and displacement.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from crash_replay.recording import Recording

from .actions import beside_the_springs, coefficients, in_curve
from .characteristic import Characteristic, characteristics
from .derived_motion import between_samples
from .effects.effect import ElementMotion
from .estimate import Description, Estimate
from .kinematics import beyond
from .structure import ModelError, Structure
from .structure_parts import NOTHING, outlasts

LONGEST_STEP = 2e-4
"""s; a coarser recording is simulated in several steps a sample."""


class Instant(NamedTuple):
    """An element's motion at one instant; see ElementMotion."""

    time: float  # s since the impact
    crush: float  # m
    rate: float  # m/s
    peak: float  # m
    static: float = 0.0  # N


class FreeRun(NamedTuple):
    """n samples after the impact, b bodies, e elements, q equations."""

    time: np.ndarray  # (n,) s
    displacement: np.ndarray  # (n, b) m
    velocity: np.ndarray  # (n, b) m/s
    acceleration: np.ndarray  # (n, b) m/s^2
    crush: np.ndarray  # (n, e) m
    force: np.ndarray  # (n, e) N
    predicted: np.ndarray  # (n, q) in the equations' units
    measured: np.ndarray  # (n, q)
    measured_velocity: np.ndarray  # (n, b) m/s, integrated measurement


def free_run(
    structure: Structure,
    description: Description,
    estimates: Sequence[Estimate],
    given: tuple[Characteristic, ...] | None = None,
    end: float = np.inf,
    recording: Recording | None = None,
) -> FreeRun:
    """Simulate over the samples from time zero to `end` s.

    The start and the driven motion are those of `estimates`; the characteristics are theirs too unless `given`,
    from another test for instance; recording: that of the estimates, for the forces that are applied to free bodies.
    Raises ModelError where nothing is left to simulate.
    """
    after = [e for e in estimates if 0 <= e.time_ns * 1e-9 <= end]
    if len(after) < 2:
        raise ModelError(f"a free run needs at least two samples from time zero to {end:g} s, found {len(after)}")
    laws = given or characteristics(structure, description, estimates)
    time = np.array([e.time_ns for e in after]) * 1e-9
    applied = _applied(structure, recording)
    run = _System(structure, laws, coefficients(structure, description, after[-1]), time, after, applied)
    x, v = after[0].displacement.copy(), after[0].velocity.copy()
    state = run.start(time[0], x, v)
    states = [state]
    for start, stop in zip(time[:-1], time[1:]):
        steps = int(np.ceil((stop - start) / LONGEST_STEP - 1e-9))
        h = (stop - start) / steps
        for k in range(steps):
            state = run.step(start + k * h, h, state)
        states.append(state)
    loads = np.array([run.loads(t, state) for t, state in zip(time, states, strict=True)])
    acceleration = np.array([run.accelerations(t, load) for t, load in zip(time, loads)])
    force = np.array([run.forces(t, state) for t, state in zip(time, states, strict=True)])
    return FreeRun(
        time=time,
        displacement=np.array([state.x for state in states]),
        velocity=np.array([state.v for state in states]),
        acceleration=acceleration,
        crush=np.array([run.motion(t, state.x, state.v)[0] for t, state in zip(time, states, strict=True)]),
        force=force,
        predicted=run.recorded(acceleration, loads),
        measured=np.array([e.measured for e in after]),
        measured_velocity=np.array([e.velocity for e in after]),
    )


class _State(NamedTuple):
    """At the end of a step."""

    time: float  # s
    x: np.ndarray  # (b,) m
    v: np.ndarray  # (b,) m/s
    peak: np.ndarray  # (e,) m, largest crush so far
    crush: np.ndarray  # (e,) m; 0 where apart without tension
    memory: np.ndarray  # (n,) of each action that remembers the way its element's crush has gone; else 0


class _System:
    """The right-hand side, with what is measured interpolated between samples."""

    def __init__(
        self, structure: Structure, laws: tuple[Characteristic, ...], c: np.ndarray, time: np.ndarray,
        after: Sequence[Estimate], applied: Mapping[int, Callable[[float], float]],
    ):  # fmt: skip
        self.structure, self.c, self.applied = structure, c, applied
        self.laws, self.ends, self.time = laws, structure.ends, time
        self.masses = np.array([b.mass if b.free else np.inf for b in structure.bodies])
        for value, action in zip(c, structure.actions):
            if action.kind == "mass":
                self.masses[action.at] += value
            elif action.kind == "inertia" and action.coefficient.estimated and action.lighter >= 0:
                self.masses[action.lighter] -= value
        self.carried = [(k, structure.body_index[b.carried_by]) for k, b in enumerate(structure.bodies) if b.carried_by]
        self.origin = np.array([e.origin for e in structure.elements])
        self.play = np.array([e.play for e in structure.elements])
        self.never_pulls = np.array([not (e.tension or e.damper_pulls) for e in structure.elements], dtype=bool)
        self.acts = {a.element for a in structure.actions if a.element >= 0}
        self.remembering = [(j, a) for j, a in enumerate(structure.actions) if a.kind == "memory"]
        self.pressed_only = np.array([not e.tension for e in structure.elements], dtype=bool)
        self.acts |= {k for k, e in enumerate(structure.elements) if e.factor}
        self.driven = [k for k, body in enumerate(structure.bodies) if body.driven]
        self.given = [k for k, element in enumerate(structure.elements) if element.displacement]
        measured = np.array([e.acceleration for e in after])
        self.driving = {k: _bridged(measured[:, k]) for k in self.driven}
        self.crushes = {k: np.array([e.crush[k] for e in after]) for k in self.given}
        self.rates = {k: np.array([e.rate[k] for e in after]) for k in self.given}

    def motion(self, t: float, x: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(e,) crush and rate."""
        crush = x[self.ends[:, 0]] - x[self.ends[:, 1]] - self.origin
        rate = v[self.ends[:, 0]] - v[self.ends[:, 1]]
        for k in self.given:
            crush[k], rate[k] = np.interp(t, self.time, self.crushes[k]), np.interp(t, self.time, self.rates[k])
        return beyond(self.play, crush, rate)

    def start(self, t: float, x: np.ndarray, v: np.ndarray) -> _State:
        nothing = np.zeros(len(self.laws))
        return self.ended(t, x, v, _State(t, x, v, nothing, nothing, np.zeros(len(self.c))))

    def ended(self, t: float, x: np.ndarray, v: np.ndarray, before: _State) -> _State:
        """The state at the end of a step: the largest crush and the memories follow there."""
        crush = self.motion(t, x, v)[0]
        memory = self.remembered(before, t, crush)
        return _State(t, x, v, np.maximum(before.peak, crush), self.pressed(crush), memory)

    def pressed(self, crush: np.ndarray) -> np.ndarray:
        return np.where(self.pressed_only, np.maximum(crush, 0.0), crush)

    def remembered(self, before: _State, t: float, crush: np.ndarray) -> np.ndarray:
        """(n,) what the actions remember at a crush within the step, or at its end."""
        time, memory = np.array([before.time, t]), before.memory.copy()
        for j, action in self.remembering:
            way = np.array([before.crush[action.at], self.pressed(crush)[action.at]])
            memory[j] = action.force(time, way, before.memory[j])[0][-1]
        return memory

    def forces(self, t: float, state: _State) -> np.ndarray:
        """(e,) N; x and v of the state may be within a step, the rest is of its beginning."""
        crush, rate = self.motion(t, state.x, state.v)
        memory = self.remembered(state, t, crush)
        peak = np.maximum(state.peak, crush)
        force = np.array([
            self.force(k, law, Instant(t, c, r, p), memory)
            for k, (law, c, r, p) in enumerate(zip(self.laws, crush, rate, peak, strict=True))
        ])  # fmt: skip
        return np.where(self.never_pulls, np.maximum(force, 0.0), force)

    def force(self, element: int, law: Characteristic, motion: Instant, memory: np.ndarray) -> float:
        """N, of an element at one instant."""
        inside = self.inside(element, motion)
        spent = not law.carries(motion.crush, motion.peak, inside)
        lasting = self.structure.elements[element].acts_when_spent
        if spent and (lasting == NOTHING or motion.crush <= 0.0):
            return 0.0
        damper = 0.0 if spent and not outlasts(lasting) else law.damping * motion.rate
        spring = law.spring(motion.crush, motion.peak, inside)
        if element not in self.acts:
            return spring + damper
        instant = ElementMotion(*(np.array([value]) for value in motion._replace(static=spring)))
        parallel, factor = beside_the_springs(self.structure, self.c, element, instant, memory, spent)
        return float(spring * factor[0] + damper + parallel[0])

    def inside(self, element: int, motion: Instant) -> float:
        """N that effects add to an element's own curve where it is read."""
        if not any(action.in_curve for action in self.structure.actions):
            return 0.0
        at = motion.peak if self.structure.elements[element].unloads else motion.crush
        return float(in_curve(self.structure.actions, self.c, element, np.array([at]))[0])

    def loads(self, t: float, state: _State) -> np.ndarray:
        """(b,) N: the elements' forces on each body, what it carries included, and what the effects add."""
        force, loads = self.forces(t, state), np.zeros(len(state.x))
        np.subtract.at(loads, self.ends[:, 0], force)
        np.add.at(loads, self.ends[:, 1], force)
        for k, host in self.carried:
            loads[host] += loads[k]
        for k, force_at in self.applied.items():
            loads[k] += force_at(t)
        for value, action in zip(self.c, self.structure.actions):
            if action.kind == "body":
                loads[action.at] += value * action.force(np.array([t]))[0]
            elif action.kind == "inertia":
                loads[action.at] -= value * np.interp(t, self.time, self.driving[action.body])
        return loads

    def recorded(self, acceleration: np.ndarray, loads: np.ndarray) -> np.ndarray:
        """(n, q) what the equations' channels would show of (n, b) accelerations and loads."""
        true = [acceleration[:, k] if self.structure.bodies[k].free else loads[:, k] for k in self.structure.equations]
        shown = np.stack(true, axis=1)
        for value, action in zip(self.c, self.structure.actions):
            if action.kind in ("gain", "offset") and action.at in self.structure.equations:
                row = self.structure.equations.index(action.at)
                more = shown[:, row] if action.kind == "gain" else 1.0
                shown[:, row] = shown[:, row] + action.share * value * more
        return shown

    def accelerations(self, t: float, loads: np.ndarray) -> np.ndarray:
        acceleration = loads / self.masses
        for k in self.driven:
            acceleration[k] = np.interp(t, self.time, self.driving[k])
        return acceleration

    def pushed(self, t: float, state: _State) -> np.ndarray:
        return self.accelerations(t, self.loads(t, state))

    def step(self, t: float, h: float, state: _State) -> _State:
        """One Runge-Kutta step of h s."""
        x, v = state.x, state.v
        a1 = self.pushed(t, state)
        v2 = v + 0.5 * h * a1
        a2 = self.pushed(t + 0.5 * h, state._replace(x=x + 0.5 * h * v, v=v2))
        v3 = v + 0.5 * h * a2
        a3 = self.pushed(t + 0.5 * h, state._replace(x=x + 0.5 * h * v2, v=v3))
        v4 = v + h * a3
        a4 = self.pushed(t + h, state._replace(x=x + h * v3, v=v4))
        x, v = x + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4), v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
        return self.ended(t + h, x, v, state)


def _applied(structure: Structure, recording: Recording | None) -> dict[int, Callable[..., Any]]:
    """N of the time in s since the impact, by body."""
    found = {}
    for k, body in enumerate(structure.bodies):
        if body.applied:
            if recording is None:
                raise ModelError(f"body {body.name} is pushed by {body.applied}: a free run needs the recording")
            found[k] = between_samples(recording.time, recording.column(body.applied))
    return found


def _bridged(values: np.ndarray) -> np.ndarray:
    """NaN replaced by a straight line between the valid neighbours; 0 where there are none."""
    valid = np.isfinite(values)
    k = np.arange(len(values))
    return np.interp(k, k[valid], values[valid]) if valid.any() else np.zeros(len(values))
