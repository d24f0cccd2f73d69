"""A free body that is heavier than the model says."""

from dataclasses import dataclass
from typing import ClassVar

from ..effect import Addition, Effect
from ..estimator_model import ROUGHLY, coefficient_of, heavier, with_action

WEIGHED = 12.0
"""Nats that a mass must gain over a law where the motion of one body is all that is measured: M a = F(X, V), and a
mass twice as large is a law half as hard. A car is weighed; its law is what the test is made to find."""


@dataclass(frozen=True)
class BodyInertia(Effect):
    """The coefficient adds to a free body's mass."""

    acts_on: ClassVar[str] = "body"
    balances_momentum: ClassVar[bool] = True

    def possible_targets(self, structure, test):
        return [body.name for body in structure.bodies if body.free]

    def put_to_work(self, structure, test, spec):
        k = structure.body_index[spec.target]
        if spec.coefficient is not None:
            return heavier(structure, k, spec.coefficient)
        scale = ROUGHLY * structure.bodies[k].mass
        return with_action(structure, spec, self.unit, "mass", k, coefficient_of(spec, self), scale)

    def mass_shares(self, addition):
        return {addition.target: 1.0}

    def candidates(self, structure, magnitudes):
        yield from (Addition(self, name) for name in self.possible_targets(structure, None))

    def prior_std(self, magnitudes, addition):
        structure = magnitudes.structure
        return ROUGHLY * structure.bodies[structure.body_index[addition.target]].mass

    def log_prior_odds_against(self, structure):
        free = [body for body in structure.bodies if body.free]
        force_measured = any(structure.bodies[k].fixed for k in structure.equations)
        return WEIGHED if len(free) == 1 and not force_measured else 0.0
