"""An external force on a free body, a function of time."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import ClassVar

import numpy as np

from ...structure import CONTACT_FREQUENCY, TYPICAL_CRUSH
from ..effect import Addition, Effect
from ..estimator_model import ROUGHLY, coefficient_of, with_action
from .element_force import HALF


@dataclass(frozen=True)
class BodyForce(Effect):
    """An external force on a free body, positive in the travel direction.

    force(time (g,) s, **shape constants) -> (g,) N per unit of the coefficient

    Its variants, where it `rises`: without its shape constants, as from time zero on (""), or with them ("rising").
    """

    force: Callable[..., np.ndarray] | None = None
    rises: bool = False

    acts_on: ClassVar[str] = "body"
    function: ClassVar[str] = "force"
    balances_momentum: ClassVar[bool] = True

    @property
    def variants(self):
        return ("", "rising") if self.rises else ("",)

    def shapes_of(self, variant):
        return {} if self.rises and not variant else self.shapes

    def possible_targets(self, structure, test):
        return [body.name for body in structure.bodies if body.free]

    def along(self, motion, **shapes):
        return self.force(motion.time, **shapes)

    def put_to_work(self, structure, test, spec):
        k = structure.body_index[spec.target]
        force = partial(self.force, **spec.shape)
        scale = ROUGHLY * structure.bodies[k].mass * CONTACT_FREQUENCY**2 * TYPICAL_CRUSH
        return with_action(structure, spec, self.unit, "body", k, coefficient_of(spec, self), scale, force=force)

    def body_load(self, addition, structure, time, inertial, **shapes):
        return addition.target, self.force(time, **shapes)

    def candidates(self, structure, magnitudes):
        for name, variant in product(self.possible_targets(structure, None), self.variants):
            shapes = self.shapes_of(variant)
            for starts in product(*(shape.starts for shape in shapes.values())):
                yield Addition(self, name, dict(zip(shapes, starts, strict=True)), variant=variant)

    def prior_std(self, magnitudes, addition):
        return HALF * magnitudes.body_force[magnitudes.structure.body_index[addition.target]]
