"""A structure with some additions, fitted to recordings."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..structure import Structure
from .assess import Left, assess
from .curves import adapted_roughness
from .fit import GRADUALLY, HOTTEST, MOST_ITERATIONS, SLOWLY, Fit, fit
from .layout import Addition, Layout, make_layout
from .records import Record
from .scales import Scales


class Model(NamedTuple):
    """The structure with some additions, fitted."""

    additions: tuple[Addition, ...]
    fit: Fit
    left: Left
    roughness: Mapping[str, np.ndarray]
    records: Sequence[Record]  # with the noise that it was fitted with


def fit_model(
    structure: Structure, records: Sequence[Record], scales: Scales, additions: Sequence[Addition],
    start: Fit | None = None,
) -> Model:  # fmt: skip
    """Fit, then let the curves fold where they were found to bend sharply, and fit again."""
    layout = make_layout(structure, records, scales, additions)
    found = fit(layout, records, (start.theta, start.trajectories) if start else None)
    if not found.cost < cost_of_nothing(records):
        found = fit(layout, records, refine=GRADUALLY)
    roughness = {
        link.name: adapted_roughness(link.curve, found.theta) for link in layout.links if link.curve is not None
    }
    if roughness and np.isfinite(found.cost):
        layout = make_layout(structure, records, scales, additions, roughness)
        found = fit(layout, records, (found.theta, found.trajectories))
    left = assess(found, records, sharply=True)
    if forces_jump(layout) and not left.whiteness.white and records[0].mix is None:
        slower = fit(layout, records, (found.theta, found.trajectories), refine=SLOWLY, most=2 * MOST_ITERATIONS)
        if slower.evidence > found.evidence:
            found, left = slower, assess(slower, records, sharply=True)
    if records[0].mix is None and not settled(found, left):
        others = [fit(layout, records, refine=stages) for stages in (GRADUALLY, HOTTEST)]
        for other in others:
            there = assess(other, records, sharply=True)
            if there.cost < left.cost:
                found, left = other, there
    return Model(tuple(additions), found, left, roughness, records)


def settled(found: Fit, left: Left) -> bool:
    """Whether what a fit takes its motion to leave, to first order, is about what that motion does leave.

    An element that springs back hard can throw the motion about from one iteration to the next; then the cost, which
    counts the defect as mended, says nothing. Above the noise, which its means over bins partly leave out, the two
    agree but for the prior's share and for what is not linear: within a factor of two.
    """
    samples = sum(np.count_nonzero(np.isfinite(residual)) for residual in left.residual)
    return (left.cost - 1.0) * samples < 2.0 * found.cost and found.cost < 2.0 * left.cost * samples


def cost_of_nothing(records: Sequence[Record]) -> float:
    """Of predicting zero: a fit that leaves more has gone astray."""
    return sum(float(np.nansum((record.measured / record.noise) ** 2)) for record in records)


def forces_jump(layout: Layout) -> bool:
    """Whether some force ends at separation other than by falling to zero."""
    one_way = [link for link in layout.links if not link.tension]
    return any(link.forces or link.damping is not None or link.known_damping for link in one_way)
