"""A force that holds a body back on the ground, a guide or a rail, however far it has come."""

from dataclasses import dataclass, replace
from typing import ClassVar

from ...structure import Body, Coefficient, Element, Structure
from ..effect import OwnLink
from .element_force import HALF, ElementForce, on_element

GROUND = "ground"
"""A fixed body of this name, which is added where the model has none."""


def ground_of(structure: Structure) -> str:
    """Name of what a guide stands on: a fixed body of that name without a load cell, which shows what elements push it
    with and nothing of guides, or one to be added."""
    bodies = {body.name: body for body in structure.bodies}
    name = GROUND
    while name in bodies and not (bodies[name].fixed and not bodies[name].force):
        name += "_"
    return name


PUSHED = 6.0
"""Nats that it must gain over a constant force, as any candidate over nothing: on a body that never comes back the two
are the same."""


@dataclass(frozen=True)
class GuideForce(ElementForce):
    """The force of an element without a spring between a free body and the ground: c f, against the body's motion."""

    acts_on: ClassVar[str] = "body"
    on_ground: ClassVar[bool] = True

    def possible_targets(self, structure, test):
        return [body.name for body in structure.bodies if body.free]

    def put_to_work(self, structure, test, spec):
        ground = ground_of(structure)
        added = () if ground in structure.body_index else (Body(ground, fixed=True),)
        guide = Element(f"{spec.target}-{ground}", (spec.target, ground), Coefficient(0.0, shape="constant"))
        guided = replace(structure, bodies=(*structure.bodies, *added), elements=(*structure.elements, guide))
        return super().put_to_work(guided, test, replace(spec, target=guide.name))

    def own_link(self, addition, structure, index, starts):
        return OwnLink((index[addition.target], index[ground_of(structure)]), tension=True, origin=(), spring=False)

    def candidates(self, structure, magnitudes):
        """On bodies that no element holds both ways to a fixed one, as there friction in the element is the same; but
        where the force on the fixed body is measured, which does not show what the ground takes."""
        fixed = {body.name for body in structure.bodies if body.fixed and not body.force}
        held = {name for e in structure.elements if e.tension and fixed & set(e.between) for name in e.between}
        for name in self.possible_targets(structure, None):
            if name not in held:
                yield from on_element(self, magnitudes, name)

    def prior_std(self, magnitudes, addition):
        return HALF * magnitudes.body_force[magnitudes.structure.body_index[addition.target]]

    def log_prior_odds_against(self, structure, c):
        return PUSHED
