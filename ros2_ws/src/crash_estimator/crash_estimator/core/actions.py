"""Effects at work in the regression: what each adds to the equations for one unit of its coefficient.

    element   a force f(motion) in parallel to an element that carries
    memory    a force z in parallel to an element that carries; z hangs on the way that its crush has gone
    factor    c h(V) times the element's static force
    body      an external force f(t) on a body, from time zero on
    inertia   a carried body m resists with -m a what its carrier makes of it
    mass      (M + c) a = sum of forces:  a = sum / (M + c)
    gain      recorded = (1 + c) true, and true moves the bodies
    offset    recorded = true + c from time zero on, likewise

The last three are not linear. They are taken linear about the latest theta: for a prediction h(theta)

    h(theta) = h(theta_0) + H (theta - theta_0),    gradient H,  known h(theta_0) - H theta_0
"""

from collections.abc import Sequence

import numpy as np

from .contact import SpringLaw
from .effects.effect import ElementMotion
from .estimate import Description, Estimate
from .kinematics import Motion
from .structure import Action, Structure

LEAST_MASS = 0.05
"""Share of a body's mass that an estimated change always leaves."""


class Actions:
    """Settings: the structure's actions, in the order of their parameters."""

    def __init__(self, structure: Structure):
        self.actions = structure.actions
        self.first = len(structure.element_parameters)
        self.share = structure.force_to_equation
        self.ends = structure.ends
        self.row = {k: row for row, k in enumerate(structure.equations)}
        self.mass = [body.mass if body.free else 1.0 for body in structure.bodies]
        self.estimated = np.array([a.coefficient.estimated for a in self.actions], dtype=bool)
        self.value = np.array([0.0 if a.coefficient.estimated else a.coefficient.value for a in self.actions])
        self.moves = [bool(body.acceleration) for body in structure.bodies]
        self.of_channels = [j for j, a in enumerate(self.actions) if a.kind in ("gain", "offset")]
        self.outlasts = [a.element >= 0 and a.outlasts(structure.elements[a.element]) for a in self.actions]
        self.unloads = np.array([element.unloads for element in structure.elements], dtype=bool)
        self.measured_crush = np.array([bool(element.displacement) for element in structure.elements], dtype=bool)

    def corrected(self, motion: Motion, theta: np.ndarray, start: tuple[np.ndarray, np.ndarray]) -> Motion:
        """The motion without the latest estimates of the channels' errors; start: (b,) m and m/s at time zero."""
        if not self.of_channels or motion.time < 0.0:
            return motion
        b, t = len(self.mass), motion.time
        by_x, by_v = np.zeros((b, len(self.of_channels))), np.zeros((b, len(self.of_channels)))
        x, v, a = (values.copy() for values in (motion.displacement, motion.velocity, motion.acceleration))
        for column, j in enumerate(self.of_channels):
            k, share, c = self.actions[j].at, self.actions[j].share, float(theta[self.first + j])
            if not self.moves[k]:
                continue
            if self.actions[j].kind == "offset":
                moved, slope = -c, -share
                signal = 0.5 * t * t, t, 1.0
            else:
                moved, slope = 1.0 / (1.0 + c) - 1.0, -share / (1.0 + c) ** 2
                signal = x[k] - start[0][k] - start[1][k] * t, v[k] - start[1][k], a[k]
            by_x[k, column], by_v[k, column] = slope * signal[0], slope * signal[1]
            x[k], v[k], a[k] = (value + share * moved * s for value, s in zip((x[k], v[k], a[k]), signal))
        crush, rate = (
            np.where(self.measured_crush, given, given + now[self.ends[:, 0]] - now[self.ends[:, 1]])
            for given, now in ((motion.crush, x - motion.displacement), (motion.rate, v - motion.velocity))
        )
        return motion._replace(
            displacement=x, velocity=v, acceleration=a, crush=crush, rate=rate, displacement_by=by_x, velocity_by=by_v
        )

    def inside(self, theta: np.ndarray, motion: Motion, peak: np.ndarray) -> np.ndarray | float:
        """(e,) N that actions add to the springs' own curves; peak (e,) m before this sample."""
        if not any(action.in_curve for action in self.actions):
            return 0.0
        at = np.where(self.unloads, np.maximum(peak, motion.crush), motion.crush)
        c = theta[self.first :]
        return np.array([in_curve(self.actions, c, k, at[[k]])[0] for k in range(len(at))])

    def forces(self, motion: Motion, law: SpringLaw, static: np.ndarray) -> np.ndarray:
        """(e, n) N: what each of n actions adds to each element's force for one unit; static (e,) N of the springs."""
        per_unit = np.zeros((len(self.ends), len(self.actions)))
        for j, action in enumerate(self.actions):
            k = action.at
            acts = action.element >= 0 and (law.crushed if self.outlasts[j] else law.carries)[k]
            if action.kind == "factor":
                per_unit[k, j] = static[k] * action.force(motion.rate[[k]])[0]
            elif action.kind == "memory" and acts:
                per_unit[k, j] = law.memory[j]
            elif action.kind == "element" and acts:
                crush = law.peak[k] if action.in_curve and law.on_line[k] else motion.crush[k]
                here = ElementMotion(
                    *(np.array([x]) for x in (motion.time, crush, motion.rate[k], law.peak[k], static[k]))
                )
                per_unit[k, j] = action.force(here)[0]
        return per_unit

    def added(
        self,
        known: np.ndarray,
        gradient: np.ndarray,
        motion: Motion,
        per_unit: np.ndarray,
        slopes: np.ndarray,
        theta: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """known (q,), gradient (q, p), and (q,) by which the elements' part of each equation has been multiplied.

        known and gradient come in with the elements' parameters alone; slopes (2, e): the forces' change with crush,
        N/m, and with rate, N s/m, for the errors of channels.
        """
        columns = self.share @ per_unit
        factor = np.ones(len(known))
        if motion.time >= 0.0:
            for j, action in enumerate(self.actions):
                if action.kind in ("body", "inertia") and action.at in self.row:
                    columns[self.row[action.at], j] += self._load(action, motion) / self.mass[action.at]
        columns[:, self.of_channels] += self._moved(motion, slopes)
        known = known + columns @ self.value
        gradient = np.hstack([gradient, np.where(self.estimated, columns, 0.0)])
        if motion.time >= 0.0:
            known = known - gradient[:, self.first :][:, self.of_channels] @ theta[self.first :][self.of_channels]
            for k, row in self.row.items():
                known[row], factor[row] = self._heavier(k, known[row], gradient[row], theta)
            for j in self.of_channels:
                known, factor = self._recorded(j, known, gradient, factor, theta)
        return known, gradient, factor

    @staticmethod
    def _load(action: Action, motion: Motion) -> float:
        """N per unit on the action's body."""
        if action.kind == "body":
            return float(action.force(np.array([motion.time]))[0])
        return -motion.held[action.body]

    def _moved(self, motion: Motion, slopes: np.ndarray) -> np.ndarray:
        """(q, errors of channels): what their errors change in the elements' forces, by the motion."""
        if motion.displacement_by is None:
            return np.zeros((len(self.share), len(self.of_channels)))
        free = ~self.measured_crush[:, None]
        by_x, by_v = (
            np.where(free, by[self.ends[:, 0]] - by[self.ends[:, 1]], 0.0)
            for by in (motion.displacement_by, motion.velocity_by)
        )
        return self.share @ (slopes[0][:, None] * by_x + slopes[1][:, None] * by_v)

    def _heavier(self, body: int, known: float, gradient: np.ndarray, theta: np.ndarray) -> tuple[float, float]:
        """The equation of a body whose mass changes with estimated coefficients -> known, factor; gradient in place."""
        signs = {self.first + j: sign for j, a in enumerate(self.actions) if (sign := _adds_mass(a, body))}
        if not signs:
            return known, 1.0
        before = self.mass[body]
        mass = max(before + sum(sign * theta[p] for p, sign in signs.items()), LEAST_MASS * before)
        factor = before / mass
        gradient *= factor
        acceleration = factor * known + gradient @ theta
        known = factor * known
        for p, sign in signs.items():
            gradient[p] -= sign * acceleration / mass
            known += sign * acceleration / mass * theta[p]
        return known, factor

    def _recorded(self, j: int, known, gradient, factor, theta) -> tuple[np.ndarray, np.ndarray]:
        """The equation of the body whose channel errs, as the channel records it; gradient in place."""
        action, p = self.actions[j], self.first + j
        row = self.row.get(action.at)
        if row is None:
            return known, factor
        known, factor = known.copy(), factor.copy()
        if action.kind == "offset":
            gradient[row, p] += action.share
            return known, factor
        true, gain = known[row] + gradient[row] @ theta, 1.0 + action.share * theta[p]
        known[row], factor[row] = gain * known[row] - action.share * true * theta[p], gain * factor[row]
        gradient[row] *= gain
        gradient[row, p] += action.share * true
        return known, factor


def _adds_mass(action: Action, body: int) -> float:
    """kg of a body's mass for one unit of an action's coefficient where it is estimated; known ones are in the mass."""
    if not action.coefficient.estimated:
        return 0.0
    return float(action.kind == "mass" and action.at == body) - float(
        action.kind == "inertia" and action.lighter == body
    )


def coefficients(structure: Structure, description: Description, last: Estimate) -> np.ndarray:
    """One for each action of the structure: known, or as estimated at last."""
    index = description.parameters.index
    return np.array([
        last.parameters[index(a.name)] if a.coefficient.estimated else a.coefficient.value for a in structure.actions
    ])  # fmt: skip


def beside_the_springs(
    structure: Structure, c: np.ndarray, element: int, motion: ElementMotion, remembered: np.ndarray | None = None,
    spent: bool = False,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """(g,) N in parallel to an element that carries, and (g,) a factor on its static force; c of each action. What
    belongs to the spring's own curve is not in it.

    remembered (n,): what each action remembers, at one instant; None: the motion is from first contact on. spent: of
    what acts where the spring is.
    """
    given = structure.elements[element].factor
    parallel = np.zeros_like(motion.crush)
    factor = np.ones_like(parallel) if given is None else given(motion.rate)
    for j, (value, action) in enumerate(zip(c, structure.actions, strict=True)):
        if spent and not action.outlasts(structure.elements[element]):
            continue
        if action.at == element and action.kind == "element" and not action.in_curve:
            parallel = parallel + value * action.force(motion)
        elif action.at == element and action.kind == "memory":
            parallel = parallel + value * (trace(structure, action, motion) if remembered is None else remembered[j])
        elif action.at == element and action.kind == "factor":
            factor = factor * (1.0 + value * action.force(motion.rate))
    return parallel, factor


def in_curve(actions: Sequence[Action], c: np.ndarray, element: int, crush: np.ndarray) -> np.ndarray:
    """(g,) N that actions add to a spring's own curve at crush (g,) m."""
    nothing = np.zeros_like(crush)
    motion = ElementMotion(nothing, crush, nothing, crush, nothing)
    ours = ((value, a) for value, a in zip(c, actions, strict=True) if a.in_curve and a.at == element)
    return sum((value * action.force(motion) for value, action in ours), nothing)


def trace(structure: Structure, action: Action, motion: ElementMotion) -> np.ndarray:
    """(g,) What an action of kind "memory" remembers along a motion from first contact on."""
    tension = structure.elements[action.at].tension
    crush = motion.crush if tension else np.maximum(motion.crush, 0.0)
    return action.force(np.concatenate([motion.time[:1], motion.time]), np.concatenate([[0.0], crush]), 0.0)[0][1:]
