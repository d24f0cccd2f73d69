"""Bodies on a line and the joints between them, integrated from event to event.

Between events all laws are smooth and Dormand and Prince's eighth-order method (E. Hairer and others, Solving ODEs I,
II.10) follows them; contact, unloading, slip and breaks are found on its dense output, and the integration begins anew
behind each. x in m and v in m/s are positive in the direction of travel.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import inf
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from ..fault import Fault
from .branches import DryFriction
from .joint import Held, Joint

RELATIVE, ABSOLUTE = 1e-8, 1e-9
"""Tolerances of a step; lengths are about a metre, so that micrometres are right, and accelerations to 1e-3 g."""

LONGEST = 2e-3
"""s: the longest step, below the shortest blow here, so that no contact comes and goes within one."""

MOST_EVENTS = 3000

AT_ZERO = 1e-10
"""m, m/s: below this a guard is at the event that has just been passed, whose rounding is no second one."""


class SimulationError(Fault):
    """The motion could not be followed."""


@dataclass(frozen=True)
class Body:
    name: str
    mass: float  # kg; inf where its motion is given, or fixed
    v: float = 0.0  # m/s at time zero and before
    motion: Callable[[float], float] | None = None  # its given acceleration, m/s^2 by time
    mass_at: Callable[[float], float] | None = None  # where it changes; what leaves takes its own momentum with it
    push: Callable[[float, float], float] | None = None  # N by time and own velocity, besides all joints


class Motion(NamedTuple):
    """Of all bodies at the times asked for."""

    time: np.ndarray
    x: np.ndarray  # (n, bodies)
    v: np.ndarray
    a: np.ndarray
    forces: np.ndarray  # (n, joints)
    events: list[tuple[float, str]]  # when, in which joint


@dataclass(frozen=True)
class Machine:
    bodies: tuple[Body, ...]
    joints: Mapping[str, Joint]
    _ends: tuple[tuple[int, int], ...] = field(init=False)
    _states: tuple[slice, ...] = field(init=False)
    _joints: tuple[Joint, ...] = field(init=False)

    def __post_init__(self):
        names = [body.name for body in self.bodies]
        ends = tuple((names.index(j.a), names.index(j.b)) for j in self.joints.values())
        object.__setattr__(self, "_ends", ends)
        object.__setattr__(self, "_joints", tuple(self.joints.values()))
        at, states = 2 * len(names), []
        for joint in self.joints.values():
            states.append(slice(at, at + joint.size))
            at += joint.size
        object.__setattr__(self, "_states", tuple(states))

    def run(self, times: np.ndarray) -> Motion:
        """From time zero, where all is touching, to the last of the times; before zero everything coasts."""
        n = len(self.bodies)
        y = np.zeros(2 * n + sum(joint.size for joint in self._joints))
        y[n : 2 * n] = [body.v for body in self.bodies]
        held = [joint.start(*self._crush(y, k)) for k, joint in enumerate(self._joints)]
        out = np.full((len(times), 3 * n + len(self.joints)), np.nan)
        before = times < 0.0
        out[before] = 0.0
        out[before, n : 2 * n] = y[n : 2 * n]
        out[before, :n] = np.outer(times[before], y[n : 2 * n])
        t, until, events = 0.0, float(times[-1]), []
        names = list(self.joints)
        while True:
            solution = self._segment(t, until, y, held)
            end = float(solution.t[-1])
            inside = (times >= t) & ((times < end) | (end >= until))
            if inside.any():
                rows = zip(times[inside].tolist(), solution.sol(times[inside]).T.tolist())
                out[inside] = [self._row(when, state, held) for when, state in rows]
            if end >= until:
                break
            fired = [k for k, when in enumerate(solution.t_events) if len(when) and when[-1] == end]
            t, y = end, solution.y[:, -1].copy()
            for joint in self._switch(fired, t, y, held):
                events.append((t, names[joint]))
            if len(events) > MOST_EVENTS:
                raise SimulationError(f"more than {MOST_EVENTS} events until {1e3 * t:.3f} ms: {events[-1][1]}")
        return Motion(times, out[:, :n], out[:, n : 2 * n], out[:, 2 * n : 3 * n], out[:, 3 * n :], events)

    # --- within a segment

    def _segment(self, t: float, until: float, y: np.ndarray, held: list[Held]):
        def event(joint: int, guard: int):
            def value(t, y):
                return self._guards(joint, y, held)[guard] + ahead

            ahead = 0.0
            ahead = 2.0 * AT_ZERO if abs(value(t, y)) < AT_ZERO else 0.0  # just passed: it must leave zero first
            value.terminal, value.direction = True, -1.0  # type: ignore[attr-defined]
            return value

        def hold(joint: int, side: int):
            """How far what holds a stuck joint is from its limits."""

            def value(t, y):
                force, low, high = self._holding(t, y.tolist(), held, joint)
                return high - force if side else force - low

            value.terminal, value.direction = True, -1.0  # type: ignore[attr-defined]
            return value

        events = [event(j, g) for j, g in self._events(y, held)]
        events += [hold(j, side) for j in self._stuck(held) for side in (0, 1)]
        solution = solve_ivp(
            lambda t, y: self._rates(t, y.tolist(), held)[0], (t, until), y, "DOP853", dense_output=True,
            events=events, rtol=RELATIVE, atol=ABSOLUTE, max_step=LONGEST,
        )  # fmt: skip
        if solution.status < 0:
            raise SimulationError(f"no step possible at {1e3 * solution.t[-1]:.3f} ms: {solution.message}")
        return solution

    def _crush(self, y, k: int) -> tuple[float, float]:
        (a, b), n = self._ends[k], len(self.bodies)
        return float(y[a] - y[b]), float(y[n + a] - y[n + b])

    def _events(self, y: np.ndarray, held: list[Held]) -> list[tuple[int, int]]:
        return [(k, g) for k in range(len(self._joints)) for g in range(len(self._guards(k, y, held)))]

    def _guards(self, k: int, y: np.ndarray, held: list[Held]) -> list[float]:
        x, v = self._crush(y, k)
        return self._joints[k].guards(x, v, tuple(y[self._states[k]].tolist()), held[k])

    def _stuck(self, held: list[Held]) -> list[int]:
        return [k for k, joint in enumerate(self._joints) if joint.sticking(held[k])]

    def _rates(self, t: float, y: list[float], held: list[Held]) -> tuple[list[float], list[float]]:
        """dy/dt and the joints' forces."""
        n = len(self.bodies)
        on = [body.push(t, y[n + i]) if body.push else 0.0 for i, body in enumerate(self.bodies)]
        forces, flows, stuck = [], [], []
        for k, (joint, (a, b), part) in enumerate(zip(self._joints, self._ends, self._states)):
            x, v, z = y[a] - y[b], y[n + a] - y[n + b], tuple(y[part])
            friction = joint.sticking(held[k])
            force = joint.force(x, v, z, held[k], friction)
            if friction:
                stuck.append(k)
            forces.append(force)
            flows.extend(joint.flow(x, v, z, held[k]))
            on[a] -= force
            on[b] += force
        pulled = [self._acceleration(i, t, on[i]) for i in range(n)]
        for k in stuck:  # one after the other: no structure here has two that could stick at once
            i, j = self._ends[k]
            between = self._yielding(i, t) + self._yielding(j, t)
            needed = (pulled[i] - pulled[j]) / between
            forces[k] += needed
            pulled[i] -= needed * self._yielding(i, t)
            pulled[j] += needed * self._yielding(j, t)
        return [*y[n : 2 * n], *pulled, *flows], forces

    def _acceleration(self, i: int, t: float, force: float) -> float:
        body = self.bodies[i]
        return body.motion(t) if body.motion else force * self._yielding(i, t)

    def _yielding(self, i: int, t: float) -> float:
        """1 / mass."""
        body = self.bodies[i]
        mass = body.mass_at(t) if body.mass_at else body.mass
        return 0.0 if mass == inf else 1.0 / mass

    def _holding(self, t: float, y: list[float], held: list[Held], k: int) -> tuple[float, float, float]:
        """What the friction of a stuck joint holds, and its limits, N: a contact lets go before it pulls."""
        joint, n = self._joints[k], len(self.bodies)
        (a, b), friction = self._ends[k], joint.sticking(held[k])
        others = joint.force(y[a] - y[b], y[n + a] - y[n + b], tuple(y[self._states[k]]), held[k], friction)
        total = self._rates(t, y, held)[1][k]
        low = max(-friction.f, -others) if joint.one_way and not joint.pulls else -friction.f
        return total - others, low, friction.f

    # --- at an event

    def _switch(self, fired: list[int], t: float, y: np.ndarray, held: list[Held]) -> list[int]:
        """Change `held` in place; the joints that changed."""
        pairs = self._events(y, held)
        stuck = [(j, side) for j in self._stuck(held) for side in (0, 1)]
        changed = []
        # a joint's branches before its phase, whose switch would change their numbers
        for k in reversed(self._at_once(fired, pairs, y, held)):
            if k >= len(pairs):
                j, side = stuck[k - len(pairs)]
                held[j] = _slipping(self._joints[j], held[j], 1 if side else -1)
            else:
                j, guard = pairs[k]
                held[j] = self._after(j, guard, t, y, held)
            changed.append(j)
        return changed

    def _at_once(self, fired: list[int], pairs: list[tuple[int, int]], y: np.ndarray, held: list[Held]) -> list[int]:
        """With those that have fallen through zero with them, as a contact's phase and a friction in it turn with the
        same rate: the solver names the first of them only."""
        values = [self._guards(j, y, held)[guard] for j, guard in pairs]
        passed = {values[k] for k in fired if k < len(pairs) and values[k] < 0.0}
        return sorted({*fired, *(k for k, value in enumerate(values) if value in passed)})

    def _after(self, j: int, guard: int, t: float, y: np.ndarray, held: list[Held]) -> Held:
        joint, (x, v) = self._joints[j], self._crush(y, j)
        after = joint.switched(guard, x, v, tuple(y[self._states[j]].tolist()), held[j])
        turned = abs(v) < 1e-6 and after.modes == held[j].modes  # a contact's phase turned, with a dry friction in it
        dry = next((n for n, branch in enumerate(joint.branches) if isinstance(branch, DryFriction)), None)
        own = dry is not None and abs(v) < 1e-6 and held[j].modes[dry] != 0
        if not own or not (turned or after.modes != held[j].modes):
            return after
        trial = after._replace(modes=(*after.modes[:dry], 0, *after.modes[dry + 1 :]))
        if not joint.sticking(trial):
            return after
        force, low, high = self._holding(t, y.tolist(), [*held[:j], trial, *held[j + 1 :]], j)
        if low <= force <= high:
            self._at_rest(j, y)
            return trial
        return _slipping(joint, after, 1 if force > high else -1)

    def _at_rest(self, j: int, y: np.ndarray) -> None:
        (a, b), n = self._ends[j], len(self.bodies)
        if self.bodies[b].mass == inf:
            y[n + a] = y[n + b]
        else:
            y[n + b] = y[n + a]

    def _row(self, t: float, y: list[float], held: list[Held]) -> list[float]:
        n = len(self.bodies)
        rates, forces = self._rates(t, y, held)
        return [*y[: 2 * n], *rates[n : 2 * n], *forces]


def _slipping(joint: Joint, held: Held, way: int) -> Held:
    modes = tuple(way if isinstance(b, DryFriction) else m for b, m in zip(joint.branches, held.modes))
    return held._replace(modes=modes)
