"""4th-order Runge-Kutta integration of a system of bodies and elements.

    M_k a_k = push_k + sum over elements of -F (where k is body a) or +F (where k is body b)

in fixed steps; driven bodies have their given acceleration instead. An element's largest crush is
part of the state: within a step it is the larger of the one so far and the present crush, so that
loading is exact; the turn to unloading falls on the end of a step, an error of second order in one step.
"""

from typing import NamedTuple

import numpy as np

from .system import System

MAX_STEP = 1e-5
"""s; ten steps for a sample at 10 kHz, which leaves errors far below what a sensor resolves."""


class State(NamedTuple):
    """b bodies, e elements, as lists: at these sizes Python's floats are faster than numpy's arrays."""

    x: list[float]  # (b,) m
    v: list[float]  # (b,) m/s
    peak: list[float]  # (e,) m, the largest crush so far, never below 0
    slipped: list[float]  # (e,) what each element's slip remembers; 0 without one


class History(NamedTuple):
    """n instants, b bodies, e elements."""

    time: np.ndarray  # (n,) s
    displacement: np.ndarray  # (n, b) m
    velocity: np.ndarray  # (n, b) m/s
    acceleration: np.ndarray  # (n, b) m/s^2
    load: np.ndarray  # (n, b) N, sum of the element forces on each body
    crush: np.ndarray  # (n, e) m
    rate: np.ndarray  # (n, e) m/s
    peak: np.ndarray  # (n, e) m
    force: np.ndarray  # (n, e) N


class _Equations:
    """The system's right-hand side, with what depends on time tabulated at every half step."""

    def __init__(self, system: System, grid: np.ndarray):
        self.bodies = len(system.bodies)
        still, steady = np.zeros(len(grid)), np.ones(len(grid))
        driven = [body.motion.acceleration(grid) if body.motion else still for body in system.bodies]
        self.driven = np.stack(driven, axis=1).tolist()
        masses = [(body.mass or 0.0) * (body.growth(grid) if body.growth else steady) for body in system.bodies]
        self.masses = np.stack(masses, axis=1).tolist()
        pushed = [body.push(grid) if body.push else still for body in system.bodies]
        self.pushed = np.stack(pushed, axis=1).tolist()
        self.links = [(a, b, element.force) for (a, b), element in zip(system.ends(), system.elements)]
        self.slips = [element.slips if element.slip else None for element in system.elements]
        self.remembers, self.nothing = any(self.slips), [0.0] * len(self.links)
        self.yields = [element.slip.largest if element.slip else 0.0 for element in system.elements]

    def crush(self, x: list[float]) -> list[float]:
        return [x[a] - x[b] for a, b, _ in self.links]

    def largest(self, peak: list[float], x: list[float]) -> list[float]:
        return list(map(max, peak, self.crush(x)))

    def forces(self, state: State) -> list[float]:
        x, v, peak, slipped = state
        each = zip(self.links, self.largest(peak, x), slipped)
        return [law(x[a] - x[b], v[a] - v[b], p, s) for (a, b, law), p, s in each]

    def flow(self, x: list[float], v: list[float], slipped: list[float]) -> list[float]:
        """(e,) 1/s, of what the slips remember."""
        if not self.remembers:
            return self.nothing
        each = zip(self.links, self.slips, slipped)
        return [slips(x[a] - x[b], v[a] - v[b], s) if slips else 0.0 for (a, b, _), slips, s in each]

    def loads(self, forces: list[float]) -> list[float]:
        loads = [0.0] * self.bodies
        for (a, b, _), force in zip(self.links, forces):
            loads[a] -= force
            loads[b] += force
        return loads

    def acceleration(
        self, node: int, x: list[float], v: list[float], peak: list[float], slipped: list[float]
    ) -> list[float]:
        loads = [0.0] * self.bodies
        for (a, b, law), largest, s in zip(self.links, peak, slipped):
            crush = x[a] - x[b]
            force = law(crush, v[a] - v[b], crush if crush > largest else largest, s)
            loads[a] -= force
            loads[b] += force
        columns = zip(loads, self.pushed[node], self.masses[node], self.driven[node])
        return [(load + push) / mass if mass else given for load, push, mass, given in columns]


def simulate(system: System, time: np.ndarray, max_step: float = MAX_STEP) -> History:
    """The system's motion at the instants `time` (n,) s, which increase from 0, the impact."""
    steps = [int(np.ceil(dt / max_step - 1e-6)) for dt in np.diff(time)]
    spans = [
        np.linspace(start, end, 2 * n, endpoint=False) for start, end, n in zip(time, time[1:], steps, strict=False)
    ]
    equations = _Equations(system, np.concatenate([*spans, time[-1:]]))
    x, v = [body.displacement for body in system.bodies], [body.velocity for body in system.bodies]
    nothing = [0.0] * len(system.elements)
    state, node = State(x, v, equations.largest(nothing, x), nothing), 0
    nodes, states = [node], [state]
    for dt, count in zip(np.diff(time).tolist(), steps):
        for _ in range(count):
            state, node = _step(equations, node, state, dt / count), node + 2
        nodes.append(node)
        states.append(state)
    return _history(equations, time, nodes, states)


def _step(equations: _Equations, node: int, state: State, h: float) -> State:
    """One step h (s) from the grid's `node` to node + 2; written out, for it is most of what a simulation takes."""
    x, v, peak, s = state
    acceleration, flow, half, sixth = equations.acceleration, equations.flow, 0.5 * h, h / 6.0
    a1, f1 = acceleration(node, x, v, peak, s), flow(x, v, s)
    x2, v2, s2 = _moved(x, half, v), _moved(v, half, a1), _moved(s, half, f1)
    a2, f2 = acceleration(node + 1, x2, v2, peak, s2), flow(x2, v2, s2)
    x3, v3, s3 = _moved(x, half, v2), _moved(v, half, a2), _moved(s, half, f2)
    a3, f3 = acceleration(node + 1, x3, v3, peak, s3), flow(x3, v3, s3)
    x4, v4, s4 = _moved(x, h, v3), _moved(v, h, a3), _moved(s, h, f3)
    a4, f4 = acceleration(node + 2, x4, v4, peak, s4), flow(x4, v4, s4)
    x_end, v_end = _moved(x, sixth, _weighted(v, v2, v3, v4)), _moved(v, sixth, _weighted(a1, a2, a3, a4))
    if equations.remembers:
        moved = _moved(s, sixth, _weighted(f1, f2, f3, f4))
        s = [min(max(slipped, -largest), largest) for slipped, largest in zip(moved, equations.yields)]
    return State(x_end, v_end, equations.largest(peak, x_end), s)


def _moved(start: list[float], h: float, slope: list[float]) -> list[float]:
    return [value + h * rate for value, rate in zip(start, slope)]


def _weighted(k1: list[float], k2: list[float], k3: list[float], k4: list[float]) -> list[float]:
    return [a + 2.0 * b + 2.0 * c + d for a, b, c, d in zip(k1, k2, k3, k4)]


def _history(equations: _Equations, time: np.ndarray, nodes: list[int], states: list[State]) -> History:
    x, v, peak, _ = (np.array(column) for column in zip(*states))
    force = np.array([equations.forces(state) for state in states])
    return History(
        time=time,
        displacement=x,
        velocity=v,
        acceleration=np.array([equations.acceleration(node, *state) for node, state in zip(nodes, states)]),
        load=np.array([equations.loads(row) for row in force.tolist()]),
        crush=np.array([equations.crush(state.x) for state in states]),
        rate=np.array([equations.crush(state.v) for state in states]),
        peak=peak,
        force=force,
    )
