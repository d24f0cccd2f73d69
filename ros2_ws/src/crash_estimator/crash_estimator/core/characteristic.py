"""Force over crush of each element, as estimated: loading, unloading, damping (thesis figures 6.5, 6.9, 6.12).

An estimator gives the force at every sample. What an element does is read off it:

    loading     the spring's force at crushes larger than any before, averaged in cells of crush, a line in between
    unloading   from the peak crush Xp down a line F = F(Xp) - Ku (Xp - X), where Ku is known or fitted to the samples
                after the peak; elastic where the force comes back about as it went
    damping     C = sum C_t V_t^2 / sum V_t^2, the constant that takes as much energy
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .actions import beside_the_springs, coefficients, in_curve
from .effects.effect import ElementMotion
from .estimate import Description, ElementState, Estimate
from .structure import Element, Structure

CELLS = 60
"""Of crush, up to the peak."""

STEEPER = 1.5
"""Times the slope of the last part of the way up: an element that comes back so much steeper has a line of its own."""

FITTED = 0.2
"""Share of the peak force below which the unloading is no longer followed: contact is ending."""

LEAST_RETURN = 1e-3
"""Share of the peak crush that must have been gone back before a slope can be told."""

STEEPEST = 100.0
"""Times the secant stiffness at the peak: beyond it the slope is not resolved."""


class Characteristic(NamedTuple):
    """One element: F = spring(X, largest X so far) + damping V, compression positive."""

    element: str
    crush: np.ndarray  # (n,) m, increasing
    force: np.ndarray  # (n,) N
    unloading: float | None  # N/m; None: elastic
    damping: float  # N s/m
    tension: bool  # False: carries compression only
    straight: bool = False  # one stiffness, which holds beyond the crushes that were met as well

    def curve(self, crush: float) -> float:
        """N, of the loading curve."""
        if self.straight:
            return float(self.force[-1] / self.crush[-1] * crush)
        return float(np.interp(crush, self.crush, self.force))

    def spring(self, crush: float, peak: float, inside: float = 0.0) -> float:
        """N, at a crush and the largest crush so far, both in m; inside: what effects add to the curve where it is
        read."""
        if not self.tension and crush <= 0.0:
            return 0.0
        if self.unloading is None or crush >= peak:
            return self.curve(crush) + inside
        force = self.curve(peak) + inside - self.unloading * (peak - crush)
        return force if self.tension and crush < 0.0 else max(force, 0.0)

    def carries(self, crush: float, peak: float, inside: float = 0.0) -> bool:
        return self.tension or (crush > 0.0 and self.spring(crush, peak, inside) > 0.0)


def characteristics(
    structure: Structure, description: Description, estimates: Sequence[Estimate]
) -> tuple[Characteristic, ...]:
    """One for each element, from the samples after the impact: spring and damper, without the structure's actions."""
    after = [estimate for estimate in estimates if estimate.time_ns >= 0]
    return tuple(
        _characteristic(k, element, structure, description, after) for k, element in enumerate(structure.elements)
    )


def _characteristic(
    k: int, element: Element, structure: Structure, description: Description, after: Sequence[Estimate]
) -> Characteristic:
    crush = np.array([e.crush[k] for e in after])
    rate = np.array([e.rate[k] for e in after])
    apart = np.array([e.state[k] == ElementState.APART for e in after])
    index = description.parameters.index(f"{element.name}.damping")
    damper = np.array([e.parameters[index] for e in after])
    force = np.where(apart, 0.0, np.array([e.force[k] for e in after]) - damper * rate)
    if structure.actions or element.factor:
        time, peak = np.array([e.time_ns for e in after]) * 1e-9, np.maximum(np.maximum.accumulate(crush), 0.0)
        motion = ElementMotion(time, crush, rate, peak, force)
        c = coefficients(structure, description, after[-1])
        parallel, factor = beside_the_springs(structure, c, k, motion)
        inside = in_curve(structure.actions, c, k, peak if element.unloads else crush)
        force = np.where(apart, 0.0, (force - parallel) / factor - inside)
    squares = float(np.sum(rate[~apart] ** 2))
    damping = float(np.sum((damper * rate**2)[~apart])) / squares if squares else element.damping.value
    if element.stiffness.shape == "constant":
        stiffness = after[-1].parameters[description.parameters.index(f"{element.name}.stiffness")]
        reach = np.array([-1.0, 0.0, 1.0]) * (float(np.abs(crush).max(initial=0.0)) or 1e-3)
        force = _as_it_can(element, stiffness * reach)
        return Characteristic(element.name, reach, force, element.unloading, damping, element.tension, True)
    slope = _unloading(element, crush, force)
    if slope is None:  # all samples lie on one curve, in tension too
        x, f = _curve(crush[~apart], force[~apart])
    else:
        x, f = _curve(*(values[_largest_so_far(crush) & ~apart] for values in (crush, force)))
    return Characteristic(element.name, x, _as_it_can(element, f), slope, damping, element.tension)


def _as_it_can(element: Element, force: np.ndarray) -> np.ndarray:
    """The force without what noise makes of it below zero: a contact that carries no tension pushes or does nothing."""
    return force if element.tension else np.maximum(force, 0.0)


def _largest_so_far(crush: np.ndarray) -> np.ndarray:
    return (crush > 0.0) & (crush >= np.maximum.accumulate(crush))


def _curve(crush: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Means in cells of crush, with the origin."""
    if not len(crush) or not np.abs(crush).max() > 0.0:
        return np.array([0.0, 1.0]), np.zeros(2)
    width = np.abs(crush).max() / CELLS
    cell = np.rint(crush / width).astype(int)
    x, f = [0.0], [0.0]
    for c in np.unique(cell):
        if c != 0:
            x.append(float(crush[cell == c].mean()))
            f.append(float(force[cell == c].mean()))
    order = np.argsort(x)
    return np.array(x)[order], np.array(f)[order]


def _unloading(element: Element, crush: np.ndarray, force: np.ndarray) -> float | None:
    """N/m: known, or fitted after the largest crush; None for an element that gives its energy back, or is known."""
    if element.unloading is not None or not element.stiffness.estimated:
        return element.unloading
    if not len(crush) or not crush.max() > 0.0:
        return None
    k = int(np.argmax(crush))
    peak, top = float(crush[k]), float(force[max(k - 2, 0) : k + 3].mean())
    turns = np.flatnonzero((np.diff(crush[k:]) > 0.0) | (force[k + 1 :] < FITTED * top))
    stop = k + (int(turns[0]) + 1 if len(turns) else len(force) - k)
    if top <= 0.0 or stop - k < 3 or not crush[k] - crush[stop - 1] > LEAST_RETURN * peak:
        return None
    slope, secant = _slope(crush[k:stop], force[k:stop], peak, top), top / peak
    way_up = np.flatnonzero(crush[: k + 1] >= crush[stop - 1])
    before = _slope(crush[way_up], force[way_up], peak, top)
    if slope < STEEPER * max(before, 0.0) + 0.1 * secant:
        return None
    return float(np.clip(slope, secant, STEEPEST * secant))


def _slope(crush: np.ndarray, force: np.ndarray, peak: float, top: float) -> float:
    """N/m, of the line through the peak that fits the samples best."""
    back = peak - crush
    return float(back @ (top - force) / max(float(back @ back), 1e-30))
