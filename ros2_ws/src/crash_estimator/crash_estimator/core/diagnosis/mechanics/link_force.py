"""One link's force along a motion, its slopes, and its derivative by every parameter that it has.

    S  = curve, constant or known stiffness at the crush X (less the gap); on an unloading line
         S(X_peak) - Ku (X_peak - X)
    F  = S (1 + c h(V)) + gate (C V + sum of c_i f_i + sum of c_j z_j)

`gate` is 1 where the link carries and 0 where it is apart; it turns within one time step, in proportion to the time
carried, so that a force that jumps at contact gives the right momentum whatever the step. Of what outlasts a spring
that is spent (`acts_when_spent`) it is 1 as long as there is crush. A link without tension whose
damper never pulls carries nothing where F is negative though S is not. What z remembers follows

    dz_t = a_t dz_{t-1} + b_t dX_t - b'_t dX_{t-1}.
"""

from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ...effects.effect import ElementMotion
from ...structure_parts import outlasts
from ..parameterization.terms import Link, Term
from .spring import NO_CURVE, Law, Spring, spring

NOTHING = np.zeros(0)
SMALL_CRUSH = 1e-6
"""m: of a central difference; what an effect's force may do within a micrometre is no physics."""

SMALL_RATE = 1e-4
"""m/s: likewise."""

FACTOR_RATE = 1e-3
"""m/s: of a factor's: a power below 1 has an infinite slope at rest, where only its mean over a step counts."""


class Memory(NamedTuple):
    """How one remembering force follows a change of the motion, over g instants."""

    kept: np.ndarray  # (g,) dz_t/dz_{t-1}
    by_crush: np.ndarray  # (g,) dz_t/dX_t, 1/m
    by_before: np.ndarray  # (g,) - dz_t/dX_{t-1}, 1/m
    force: np.ndarray  # (g,) N, dF_t/dz_t


class _Inside(NamedTuple):
    """What an effect adds to the spring's curve where that is read."""

    force: np.ndarray  # (g,) N
    slope: np.ndarray  # (g,) N/m
    parameters: list[int]
    columns: list[np.ndarray]  # (g,) dF/dparameter


class _Beside:
    """Forces beside the spring that act through the same gate: their sum, N, and its slopes by crush and rate."""

    def __init__(self, gate: np.ndarray, slope: np.ndarray):
        """gate (g,), and its change with the crush, 1/m."""
        self.gate, self.slope = gate, slope
        self.force = self.px = self.pv = np.zeros_like(gate)

    def add(self, force: np.ndarray, px: np.ndarray | float, pv: np.ndarray | float) -> None:
        self.force, self.px, self.pv = self.force + force, self.px + px, self.pv + pv


class LinkForce(NamedTuple):
    """g instants, m parameters."""

    force: np.ndarray  # (g,) N
    kx: np.ndarray  # (g,) dF/dX
    kv: np.ndarray  # (g,) dF/dV
    kp: np.ndarray  # (g,) dF/dX_peak
    loading: np.ndarray  # (g,) bool
    knot: np.ndarray  # (g, 2) parameters of the knots in use, -1: none
    weight: np.ndarray  # (g, 2)
    parameters: list[int]  # the m others
    columns: list[np.ndarray]  # m of (g,), dF/dparameter
    apart: np.ndarray  # (g,) bool
    unloads: np.ndarray  # (g,) bool
    memories: list[Memory]


def link_force(link: Link, theta: np.ndarray, time, dt, crush: np.ndarray, rate: np.ndarray) -> LinkForce:
    """Force of a link over crush (g,) m and rate (g,) m/s; dt (g,) s: what an instant stands for."""
    parameters: list[int] = []
    columns: list[np.ndarray] = []
    law = _law(link, theta)
    found = Spring(*spring(law, crush, rate, dt, NOTHING, NOTHING))
    inside = [_inside(term, theta, found.at) for term in link.in_curve]
    if inside:  # where the curve is read hangs on the crush alone
        more, steeper = (sum(each) for each in zip(*((one.force, one.slope) for one in inside), strict=True))
        found = Spring(*spring(law, crush, rate, dt, more, steeper))
    x, peak, on_line, at = found.x, found.peak, found.on_line, found.at
    static, kx, carries = found.static, found.kx, found.carries
    kp, weight = found.kp * carries, found.weight * carries[:, None]
    factor = np.ones_like(x)
    kv, force = np.zeros_like(x), static
    motion = ElementMotion(time, x, rate, peak, static)
    if link.factors:
        for term in link.factors:
            c = theta[term.coefficient]
            h, dh, by_shape = _factor(term, theta, motion)
            factor = factor + c * h
            kv = kv + static * c * dh
            parameters += [term.coefficient, *term.shapes.values()]
            columns += [static * h, *(static * c * d for d in by_shape)]
        force, kx, kp, weight = static * factor, kx * factor, kp * factor, weight * factor[:, None]
    by_stiffness = x if link.plastic else at  # the line's slope is the same parameter
    if link.curve is None and link.constant is not None:
        parameters.append(link.constant)
        columns.append(by_stiffness * carries * factor)
    if link.gap is not None:
        parameters.append(link.gap)
        columns.append(-law.gap * kx)

    for one in inside:
        parameters += one.parameters
        columns += [column * carries * factor for column in one.columns]

    damping = theta[link.damping] if link.damping is not None else link.known_damping
    memories: list[Memory] = []
    if damping or link.damping is not None or link.parallel or link.remembering:
        contact = _Beside(found.gate, found.gate_slope)
        crushed = _Beside(found.crushed, found.crushed_slope) if law.unloads else contact
        beside = crushed if outlasts(link.acts_when_spent) else contact
        beside.add(damping * rate, 0.0, damping)
        if link.damping is not None:
            parameters.append(link.damping)
            columns.append(beside.gate * rate)
        for term in link.parallel:
            c = theta[term.coefficient]
            f = term.along(motion, theta)
            beside = crushed if link.outlasts(term.addition.effect) else contact
            parameters.append(term.coefficient)
            columns.append(beside.gate * f)
            if not c:  # nothing that a slope or a shape constant would change
                continue
            fx, fv, by_shape = _slopes(term, theta, motion, f)
            beside.add(c * f, c * fx, c * fv)
            parameters += term.shapes.values()
            columns += [beside.gate * c * d for d in by_shape]
        for term in link.remembering:
            beside = crushed if link.outlasts(term.addition.effect) else contact
            memories += _remembered(term, link, theta, time, x, beside, parameters, columns)
        for beside in (contact, crushed) if crushed is not contact else (contact,):
            force = force + beside.gate * beside.force
            kx, kv = kx + beside.gate * beside.px + beside.slope * beside.force, kv + beside.gate * beside.pv
        if law.unloads:
            # on the unloading line it is the spring's force that opens the contact: what changes it, moves the instant
            opens = np.where(on_line, found.gate_slope * contact.force / max(law.slope, 1.0), 0.0)
            weight, kp = weight + opens[:, None] * found.weight, kp + opens * found.kp
            moved = {p: column for one in inside for p, column in zip(*one[2:], strict=True)}
            moved[link.constant] = by_stiffness
            columns = [c + opens * moved.get(p, 0.0) for p, c in zip(parameters, columns, strict=True)]
    side = np.sign(crush) if law.play else 1.0
    for term in link.in_law:
        column = term.addition.effect.law_derivative(side, on_line, (x - peak) * carries * factor, kx, kp)
        if column is not None:
            parameters.append(term.coefficient)
            columns.append(column)
    unloads = on_line if law.unloads else rate < 0.0
    apart = carries == 0.0
    if law.one_way and not link.damper_pulls:
        acts = (force >= 0.0) | (static < 0.0)
        apart |= ~acts
        force, kx, kv, kp, weight = force * acts, kx * acts, kv * acts, kp * acts, weight * acts[:, None]
        columns = [column * acts for column in columns]
        memories = [memory._replace(force=memory.force * acts) for memory in memories]
    return LinkForce(
        force, kx, kv, kp, found.loading, found.knot, weight, parameters, columns, apart, unloads, memories
    )


def _law(link: Link, theta: np.ndarray) -> Law:
    curve, stiffness = NO_CURVE, link.known_stiffness
    if link.curve is not None:
        curve = link.curve.knots, link.curve.forces(theta), link.curve.column
    elif link.constant is not None:
        stiffness = theta[link.constant]
    slope = stiffness if link.plastic else link.unloading
    gap = 0.0 if link.gap is None else float(np.exp(theta[link.gap]))
    law = Law(gap, False, slope is not None, float(slope or 0.0), *curve, float(stiffness), not link.tension)
    for term in link.in_law:
        law = term.addition.effect.changed_law(law, float(theta[term.coefficient]), term.addition.variant)
    return law


def _inside(term: Term, theta: np.ndarray, at: np.ndarray) -> _Inside:
    nothing, c = np.zeros_like(at), theta[term.coefficient]
    motion = ElementMotion(nothing, at, nothing, at, nothing)
    f = term.along(motion, theta)
    slope, _, by_shape = _slopes(term, theta, motion, f)
    parameters = [term.coefficient, *term.shapes.values()]
    return _Inside(c * f, c * slope, parameters, [f, *(c * each for each in by_shape)])


def _remembered(term: Term, link: Link, theta, time, x, beside: _Beside, parameters, columns) -> list[Memory]:
    """c z is added to the forces beside the spring, derivatives are appended -> its memory, where c z is something."""
    c, shapes = theta[term.coefficient], term.shapes_at(theta)
    effect: Any = term.addition.effect  # of the kind that has a memory
    memory = partial(effect.memory, np.concatenate([time[:1], time]), form=term.addition.variant)
    crush = np.concatenate([[0.0], x if link.tension else np.maximum(x, 0.0)])
    z, kept, by_crush, by_before = (each[1:] for each in memory(crush, 0.0, **shapes))
    gate = beside.gate
    parameters.append(term.coefficient)
    columns.append(gate * z)
    if not c:  # nothing that the motion or a shape constant would change
        return []
    parameters += term.shapes.values()
    columns += [gate * c * d for d in term.by_shapes(theta, z, lambda **s: memory(crush, 0.0, **s)[0][1:])]
    if not link.tension:
        by_crush, by_before = by_crush * (x > 0.0), by_before * (crush[:-1] > 0.0)
    beside.add(c * z, c * by_crush, 0.0)
    return [Memory(kept, by_crush, by_before, gate * c)]


def _slopes(term: Term, theta: np.ndarray, motion: ElementMotion, force: np.ndarray):
    """Of an effect's force (g,), by crush and rate, and its derivatives by the logarithm of each shape constant."""
    effect = term.addition.effect
    fx = 0.0 if effect.of_rate_only else _slope(term, theta, motion, "crush", SMALL_CRUSH)
    fv = 0.0 if effect.of_crush_only else _slope(term, theta, motion, "rate", SMALL_RATE)
    return fx, fv, term.by_shapes(theta, force, lambda **shapes: effect.along(motion, **shapes))


def _factor(term: Term, theta: np.ndarray, motion: ElementMotion):
    """h, dh/dV, and its derivatives by the logarithm of each shape constant."""
    effect, factor = term.addition.effect, term.along(motion, theta)
    by_shape = term.by_shapes(theta, factor, lambda **shapes: effect.along(motion, **shapes))
    return factor, _slope(term, theta, motion, "rate", FACTOR_RATE), by_shape


def _slope(term: Term, theta: np.ndarray, motion: ElementMotion, by: str, step: float) -> np.ndarray:
    """(g,) of an effect's function of the motion, by its "crush" or its "rate": a central difference."""
    changed = (motion._replace(**{by: getattr(motion, by) + change}) for change in (step, -step))
    up, down = (term.along(each, theta) for each in changed)
    return (up - down) / (2.0 * step)
