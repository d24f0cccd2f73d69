"""One link's force along a motion, its slopes, and its derivative by every parameter that it has.

    S  = curve, constant or known stiffness at the crush X (less the gap); on an unloading line
         S(X_peak) - Ku (X_peak - X)
    F  = S (1 + c h(V)) + gate (C V + sum of c_i f_i)

`gate` is 1 where the link carries and 0 where it is apart; it turns within one time step, in proportion to the time
carried, so that a force that jumps at contact gives the right momentum whatever the step. A link without tension that
never pulls carries nothing where F is negative though S is not.
"""

from typing import NamedTuple

import numpy as np

from ..effects.base import ElementMotion
from .layout import Link, Place
from .spring import NO_CURVE, Law, Spring, spring

SMALL_CRUSH = 1e-6
SMALL_RATE = 1e-4


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


def link_force(link: Link, theta: np.ndarray, time, dt, crush: np.ndarray, rate: np.ndarray) -> LinkForce:
    """Force of a link over crush (g,) m and rate (g,) m/s."""
    parameters: list[int] = []
    columns: list[np.ndarray] = []
    found = _spring(link, theta, dt, crush, rate)
    x, peak, on_line, at, gate, gate_slope = (
        found.x, found.peak, found.on_line, found.at, found.gate, found.gate_slope
    )  # fmt: skip
    static, kx, kp, weight, open_ = found.static, found.kx, found.kp, found.weight, found.carries
    if link.curve is None and link.constant is not None:
        parameters.append(link.constant)
        columns.append(at * open_)
    if link.slope is not None:
        parameters.append(link.slope)
        columns.append(np.where(on_line, x - peak, 0.0) * open_)

    kv, force = np.zeros_like(x), static
    if link.factors:
        factor = np.ones_like(x)
        for place in link.factors:
            c, h, dh = _factor(place, theta, rate, dt)
            factor = factor + c * h[0]
            kv = kv + static * c * dh
            parameters += [place.coefficient, *place.shapes.values()]
            columns += [static * h[0], *(static * c * d for d in h[1:])]
        force, kx, kp, weight = static * factor, kx * factor, kp * factor, weight * factor[:, None]
        columns = [
            column * factor if p in (link.constant, link.slope) else column for p, column in zip(parameters, columns)
        ]

    damping = theta[link.damping] if link.damping is not None else link.known_damping
    if damping or link.damping is not None or link.forces:
        slope = _slope(link, theta)
        parallel, px, pv = damping * rate, np.zeros_like(x), np.full_like(x, damping)
        if link.damping is not None:
            parameters.append(link.damping)
            columns.append(gate * rate)
        motion = ElementMotion(time, x, rate, peak, static)
        for place in link.forces:
            c = theta[place.coefficient]
            f = place.addition.effect.force(motion, **_shapes(place, theta))
            parameters.append(place.coefficient)
            columns.append(gate * f)
            if not c:  # nothing that a slope or a shape constant would change
                continue
            fx, fv, by_shape = _slopes(place, theta, motion)
            parallel, px, pv = parallel + c * f, px + c * fx, pv + c * fv
            parameters += place.shapes.values()
            columns += [gate * c * d for d in by_shape]
        force = force + gate * parallel
        kx, kv = kx + gate * px + gate_slope * parallel, kv + gate * pv
        if slope is not None:
            # on the unloading line it is the spring's force that opens the contact: what changes it, moves the instant
            opens = np.where(on_line, gate_slope * parallel / max(slope, 1.0), 0.0)
            weight, kp = weight + opens[:, None] * found.weight_line, kp + opens * found.kp_line
            columns = [c + opens * at if p == link.constant else c for p, c in zip(parameters, columns)]
    if link.gap is not None:
        parameters.append(link.gap)
        columns.append(-np.where(on_line, kx + kp, kx))
    unloads = rate < 0.0 if _slope(link, theta) is None else on_line
    apart = open_ == 0.0
    if not link.pulls and _one_way(link):
        acts = (force >= 0.0) | (static < 0.0)
        apart |= ~acts
        force, kx, kv, kp, weight = force * acts, kx * acts, kv * acts, kp * acts, weight * acts[:, None]
        columns = [column * acts for column in columns]
    return LinkForce(force, kx, kv, kp, found.loading, found.knot, weight, parameters, columns, apart, unloads)


def _one_way(link: Link) -> bool:
    return not link.tension or link.gap is not None


def _slope(link: Link, theta: np.ndarray) -> float | None:
    """N/m of the line on which it unloads; None where it does so on its curve."""
    return theta[link.slope] if link.slope is not None else link.unloading


def _spring(link: Link, theta: np.ndarray, dt, crush: np.ndarray, rate: np.ndarray) -> Spring:
    slope, curve, stiffness = _slope(link, theta), NO_CURVE, link.known_stiffness
    if link.curve is not None:
        curve = link.curve.knots, np.where(link.curve.column >= 0, theta[link.curve.column], 0.0), link.curve.column
    elif link.constant is not None:
        stiffness = theta[link.constant]
    law = Law(
        float(theta[link.gap]) if link.gap is not None else 0.0, slope is not None, float(slope or 0.0),
        *curve, float(stiffness), _one_way(link),
    )  # fmt: skip
    return Spring(*spring(law, crush, rate, dt))


def _shapes(place: Place, theta: np.ndarray, changed: str = "", by: float = 0.0) -> dict[str, float]:
    return {name: float(np.exp(theta[p] + (by if name == changed else 0.0))) for name, p in place.shapes.items()}


LOG_STEP = 1e-4


def _slopes(place: Place, theta, motion: ElementMotion):
    """Of an effect's force, by crush and rate, and its derivatives by the logarithm of each shape constant."""
    effect, shapes = place.addition.effect, _shapes(place, theta)

    def shifted(sign):
        crush = motion.crush + sign * SMALL_CRUSH
        return effect.force(motion._replace(crush=crush), **shapes)

    def faster(sign):
        return effect.force(motion._replace(rate=motion.rate + sign * SMALL_RATE), **shapes)

    fx = (shifted(1.0) - shifted(-1.0)) / (2.0 * SMALL_CRUSH)
    fv = (faster(1.0) - faster(-1.0)) / (2.0 * SMALL_RATE)
    by_shape = [
        (
            effect.force(motion, **_shapes(place, theta, name, LOG_STEP))
            - effect.force(motion, **_shapes(place, theta, name, -LOG_STEP))
        )
        / (2.0 * LOG_STEP)
        for name in place.shapes
    ]
    return fx, fv, by_shape


def _factor(place: Place, theta, rate, dt):
    """c; h and its derivatives by the shape constants; dh/dV."""
    effect, shapes = place.addition.effect, _shapes(place, theta)
    h = [effect.factor(rate, **shapes)]
    step = 1e-3  # m/s: a power below 1 has an infinite slope at rest, where only its mean over a step counts
    dh = (effect.factor(rate + step, **shapes) - effect.factor(rate - step, **shapes)) / (2.0 * step)
    for name in place.shapes:
        up = effect.factor(rate, **_shapes(place, theta, name, LOG_STEP))
        down = effect.factor(rate, **_shapes(place, theta, name, -LOG_STEP))
        h.append((up - down) / (2.0 * LOG_STEP))
    return theta[place.coefficient], h, dh
