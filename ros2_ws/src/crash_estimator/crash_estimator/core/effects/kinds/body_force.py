"""An external force on a free body, a function of time."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...structure import CONTACT_FREQUENCY, TYPICAL_CRUSH
from ..effect import Addition, Effect
from ..estimator_model import ROUGHLY, coefficient_of, with_action
from .element_force import HALF


@dataclass(frozen=True)
class BodyForce(Effect):
    """An external force on a free body, positive in the travel direction.

    force(time (g,) s) -> (g,) N per unit of the coefficient
    """

    force: Callable[..., np.ndarray] | None = None

    acts_on: ClassVar[str] = "body"
    function: ClassVar[str] = "force"
    balances_momentum: ClassVar[bool] = True

    def possible_targets(self, structure, test):
        return [body.name for body in structure.bodies if body.free]

    def trial(self, motion, **shapes):
        return self.force(motion.time, **shapes)

    def put_to_work(self, structure, test, spec):
        k = structure.body_index[spec.target]
        scale = ROUGHLY * structure.bodies[k].mass * CONTACT_FREQUENCY**2 * TYPICAL_CRUSH
        return with_action(structure, spec, self.unit, "body", k, coefficient_of(spec, self), scale, force=self.force)

    def body_load(self, addition, time, inertial):
        return addition.target, self.force(time)

    def candidates(self, structure, magnitudes):
        yield from (Addition(self, name) for name in self.possible_targets(structure, None))

    def prior_std(self, magnitudes, addition):
        return HALF * magnitudes.body_force[magnitudes.structure.body_index[addition.target]]
