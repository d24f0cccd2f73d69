"""One link's force along a motion, its slopes, and its derivative by every parameter that it has.

    S  = curve, constant or known stiffness at the crush X (less the gap); on an unloading line
         S(X_peak) - Ku (X_peak - X)
    F  = S (1 + c h(V)) + gate (C V + sum of c_i f_i + sum of c_j z_j)

`gate` is 1 where the link carries and 0 where it is apart; it turns within one time step, in proportion to the time
carried, so that a force that jumps at contact gives the right momentum whatever the step. A link without tension whose
damper never pulls carries nothing where F is negative though S is not. What z remembers follows

    dz_t = a_t dz_{t-1} + b_t (dX_t - dX_{t-1}),
"""

from functools import partial
from typing import NamedTuple

import numpy as np

from ...effects.effect import ElementMotion
from ..parameterization.terms import Link, Term
from .spring import NO_CURVE, Law, Spring, spring

SMALL_CRUSH = 1e-6
"""m: of a central difference; what an effect's force may do within a micrometre is no physics."""

SMALL_RATE = 1e-4
"""m/s: likewise."""

FACTOR_RATE = 1e-3
"""m/s: of a factor's: a power below 1 has an infinite slope at rest, where only its mean over a step counts."""

LOG_STEP = 1e-4
"""Of the logarithm of a shape constant: a central difference errs by its square."""


class Memory(NamedTuple):
    """How one remembering force follows a change of the motion, over g instants."""

    kept: np.ndarray  # (g,) dz_t/dz_{t-1}
    by_crush: np.ndarray  # (g,) dz_t/dX_t = - dz_t/dX_{t-1}, 1/m
    force: np.ndarray  # (g,) N, dF_t/dz_t


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
    found = Spring(*spring(law, crush, rate, dt))
    x, peak, on_line, at, gate = found.x, found.peak, found.on_line, found.at, found.gate
    static, kx, kp, weight, carries = found.static, found.kx, found.kp, found.weight, found.carries
    factor = np.ones_like(x)
    kv, force = np.zeros_like(x), static
    if link.factors:
        for term in link.factors:
            c = theta[term.coefficient]
            h, dh, by_shape = _factor(term, theta, rate)
            factor = factor + c * h
            kv = kv + static * c * dh
            parameters += [term.coefficient, *term.shapes.values()]
            columns += [static * h, *(static * c * d for d in by_shape)]
        force, kx, kp, weight = static * factor, kx * factor, kp * factor, weight * factor[:, None]
    if link.curve is None and link.constant is not None:
        parameters.append(link.constant)
        columns.append(at * carries * factor)

    damping = theta[link.damping] if link.damping is not None else link.known_damping
    memories: list[Memory] = []
    if damping or link.damping is not None or link.parallel or link.remembering:
        parallel, px, pv = damping * rate, np.zeros_like(x), np.full_like(x, damping)
        if link.damping is not None:
            parameters.append(link.damping)
            columns.append(gate * rate)
        motion = ElementMotion(time, x, rate, peak, static)
        for term in link.parallel:
            c = theta[term.coefficient]
            f = term.addition.effect.force(motion, **_shapes(term, theta))
            parameters.append(term.coefficient)
            columns.append(gate * f)
            if not c:  # nothing that a slope or a shape constant would change
                continue
            fx, fv, by_shape = _slopes(term, theta, motion)
            parallel, px, pv = parallel + c * f, px + c * fx, pv + c * fv
            parameters += term.shapes.values()
            columns += [gate * c * d for d in by_shape]
        for term in link.remembering:
            parallel, memory = _remembered(term, link, theta, x, gate, parallel, parameters, columns)
            px = px + theta[term.coefficient] * memory.by_crush
            memories.append(memory)
        force = force + gate * parallel
        kx, kv = kx + gate * px + found.gate_slope * parallel, kv + gate * pv
        if law.unloads:
            # on the unloading line it is the spring's force that opens the contact: what changes it, moves the instant
            opens = np.where(on_line, found.gate_slope * parallel / max(law.slope, 1.0), 0.0)
            weight, kp = weight + opens[:, None] * found.weight_line, kp + opens * found.kp_line
            columns = [c + opens * at if p == link.constant else c for p, c in zip(parameters, columns, strict=True)]
    for term in link.in_law:
        column = term.addition.effect.law_derivative(on_line, (x - peak) * carries * factor, kx, kp)
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
        curve = link.curve.knots, np.where(link.curve.column >= 0, theta[link.curve.column], 0.0), link.curve.column
    elif link.constant is not None:
        stiffness = theta[link.constant]
    slope = link.unloading
    law = Law(0.0, slope is not None, float(slope or 0.0), *curve, float(stiffness), not link.tension)
    for term in link.in_law:
        law = term.addition.effect.changed_law(law, float(theta[term.coefficient]))
    return law


def _remembered(term: Term, link: Link, theta, x, gate, parallel, parameters, columns) -> tuple[np.ndarray, Memory]:
    """The parallel force with c z added, and its memory; derivatives are appended."""
    c, shapes = theta[term.coefficient], _shapes(term, theta)
    memory = partial(term.addition.effect.memory, form=term.addition.variant)
    crush = np.concatenate([[0.0], x if link.tension else np.maximum(x, 0.0)])
    z, kept, by_crush = (each[1:] for each in memory(crush, 0.0, **shapes))
    parameters += [term.coefficient, *term.shapes.values()]
    columns += [gate * z]
    columns += [gate * c * d for d in _by_shapes(term, theta, lambda **s: memory(crush, 0.0, **s)[0][1:])]
    follows = by_crush if link.tension else np.where(x > 0.0, by_crush, 0.0)
    return parallel + c * z, Memory(kept, follows, gate * c)


def _shapes(term: Term, theta: np.ndarray, changed: str = "", by: float = 0.0) -> dict[str, float]:
    return {name: float(np.exp(theta[p] + (by if name == changed else 0.0))) for name, p in term.shapes.items()}


def _by_shapes(term: Term, theta: np.ndarray, function) -> list[np.ndarray]:
    """Derivatives of function(**shapes) by the logarithm of each shape constant."""
    return [
        (function(**_shapes(term, theta, name, LOG_STEP)) - function(**_shapes(term, theta, name, -LOG_STEP)))
        / (2.0 * LOG_STEP)
        for name in term.shapes
    ]


def _slopes(term: Term, theta: np.ndarray, motion: ElementMotion):
    """Of an effect's force, by crush and rate, and its derivatives by the logarithm of each shape constant."""
    effect, shapes = term.addition.effect, _shapes(term, theta)

    def shifted(sign):
        return effect.force(motion._replace(crush=motion.crush + sign * SMALL_CRUSH), **shapes)

    def faster(sign):
        return effect.force(motion._replace(rate=motion.rate + sign * SMALL_RATE), **shapes)

    fx = (shifted(1.0) - shifted(-1.0)) / (2.0 * SMALL_CRUSH)
    fv = (faster(1.0) - faster(-1.0)) / (2.0 * SMALL_RATE)
    return fx, fv, _by_shapes(term, theta, lambda **shapes: effect.force(motion, **shapes))


def _factor(term: Term, theta: np.ndarray, rate: np.ndarray):
    """h, dh/dV, and its derivatives by the logarithm of each shape constant."""
    effect, shapes = term.addition.effect, _shapes(term, theta)
    up, down = (effect.factor(rate + step, **shapes) for step in (FACTOR_RATE, -FACTOR_RATE))
    by_shape = _by_shapes(term, theta, lambda **shapes: effect.factor(rate, **shapes))
    return effect.factor(rate, **shapes), (up - down) / (2.0 * FACTOR_RATE), by_shape
