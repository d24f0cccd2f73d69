"""A spring of its own between two bodies that no spring joins."""

from dataclasses import dataclass, replace
from itertools import combinations, permutations
from typing import ClassVar

import numpy as np

from ...kinematics import initial_motion
from ...structure import Element
from ..effect import Addition, Effect, OwnLink
from ..estimator_model import coefficient_of
from .element_force import HALF

REACHED = (0.1, 0.25, 0.5, 0.7, 0.85)
"""Shares of how much closer than at time zero two bodies come, from which a gap is searched for: of an engine that is
0.3 m from the barrier a fit from 0.55 of that way on ends at the gap, and one from 0.28 of it far from it. The two
small ones are for what is reached at once. With three of them, and with ten, 23 looked-at cases were told the same."""


@dataclass(frozen=True)
class PairSpring(Effect):
    """An element of its own between two bodies that no spring of the model joins: F = c X.

    Its variants: it carries both ways, its crush counted from time zero (""), or from where its bodies' displacements
    agree (absolute); or compression only, with the second body before the first (one_way), or behind (one_way_back);
    or likewise once they have come closer than at time zero by a gap that is found (late, late_back).
    """

    acts_on: ClassVar[str] = "between"
    variants: ClassVar[tuple[str, ...]] = ("", "absolute", "one_way", "one_way_back", "late", "late_back")

    def shapes_of(self, variant):
        return self.shapes if variant.startswith("late") else {}

    def possible_targets(self, structure, test):
        return [f"{a.name}-{b.name}" for a, b in permutations(structure.bodies, 2) if a.free or b.free]

    def put_to_work(self, structure, test, spec):
        start = initial_motion(structure, test)[0]
        link = self.own_link(
            Addition(self, spec.target, variant=spec.variant), structure, structure.body_index, [start]
        )
        element = Element(
            spec.target,
            tuple(structure.bodies[k].name for k in link.ends),
            replace(coefficient_of(spec, self), shape="constant"),
            tension=link.tension,
            origin=(link.origin[0] if link.origin else 0.0) + spec.shape.get("gap", 0.0),
        )
        return replace(structure, elements=(*structure.elements, element))

    def own_link(self, addition, structure, index, starts):
        ends = ends_of(addition.target, index)
        if addition.variant.endswith("_back"):
            ends = ends[::-1]
        from_zero = not addition.variant or addition.variant.startswith("late")
        origin = tuple(float(x[ends[0]] - x[ends[1]]) for x in starts) if from_zero else ()
        return OwnLink(ends, addition.variant in ("", "absolute"), origin)

    def candidates(self, structure, magnitudes):
        """Both ways, counted from time zero or not, and one way where the bodies come close enough to touch, at once or
        later."""
        joined = {frozenset(element.between) for element in structure.elements if element.has_spring}
        starts = [record.initial_displacement for record in magnitudes.records]
        for (i, a), (k, b) in combinations(enumerate(structure.bodies), 2):
            if frozenset((a.name, b.name)) in joined or not (a.free or b.free):
                continue
            target = f"{a.name}-{b.name}"
            crush = np.concatenate([motion.x[:, i] - motion.x[:, k] for motion in magnitudes.measured])
            yield Addition(self, target)
            if any(abs(x[i] - x[k]) > 0.0 for x in starts):
                yield Addition(self, target, variant="absolute")
            for variant, reach in (("one_way", crush), ("one_way_back", -crush)):
                if reach.max() > 0.0 and reach.min() < 0.0:
                    yield Addition(self, target, variant=variant)
            closer = crush - np.concatenate(
                [np.full(len(m.x), x[i] - x[k]) for m, x in zip(magnitudes.measured, starts)]
            )
            for variant, reach in (("late", closer), ("late_back", -closer)):
                for gap in np.multiply(REACHED, reach.max()).tolist():
                    if self.shapes["gap"].low < gap < self.shapes["gap"].high:
                        yield Addition(self, target, {"gap": gap}, variant=variant)

    def prior_std(self, magnitudes, addition):
        a, b = ends_of(addition.target, magnitudes.structure.body_index)
        force = min(magnitudes.body_force[a], magnitudes.body_force[b])
        return HALF * force / max(magnitudes.change_of_distance(a, b), magnitudes.shortest_crush)


def ends_of(target: str, index) -> tuple[int, int]:
    """The two bodies of "body_a-body_b"; a name may have hyphens of its own."""
    a, b = next((a, b) for a in index for b in index if f"{a}-{b}" == target)
    return index[a], index[b]
