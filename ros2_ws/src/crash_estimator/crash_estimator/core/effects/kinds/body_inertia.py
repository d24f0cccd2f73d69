"""A free body that is heavier than the model says, or lighter."""

from dataclasses import dataclass, replace
from typing import ClassVar

from ..effect import Addition, Effect
from ..estimator_model import ROUGHLY, coefficient_of, heavier, with_action

WEIGHED = 12.0
"""Nats that a mass must gain over a law where the motion of one body is all that is measured: M a = F(X, V), and a
mass twice as large is a law half as hard. A car is weighed; its law is what the test is made to find."""

WEIGHED_TO = 0.01
"""Standard deviation of a mass, as a share of it: scales are better, but what of a structure moves with its sensor is
hardly known to a percent. Ours: tests with masses off by 1 to 2 % were adequate with it; halved and doubled it changed
nothing of 34 looked-at cases."""

LEFT_OUT = 3.0
"""Nats, ln 20, that a lighter body must gain over a heavier one: of two bodies whose forces nothing measures only the
ratio of the masses shows, and what was left out of a model is far commoner than what was counted twice. Halved
and doubled it changed nothing of 34 looked-at cases."""


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
        mass = structure.bodies[k].mass
        coefficient = replace(coefficient_of(spec, self), min=-ROUGHLY * mass)
        return with_action(structure, spec, self.unit, "mass", k, coefficient, ROUGHLY * mass)

    def mass_shares(self, addition):
        return {addition.target: 1.0}

    def candidates(self, structure, magnitudes):
        yield from (Addition(self, name) for name in self.possible_targets(structure, None))

    def prior_std(self, magnitudes, addition):
        return ROUGHLY * self._mass(magnitudes.structure, addition)

    def limits(self, magnitudes, addition):
        """A body that would be lighter by more than effects make up is another body, or none; and one more than twice
        as heavy is stated in another unit."""
        mass = self._mass(magnitudes.structure, addition)
        return -ROUGHLY * mass, mass

    def log_prior_odds_against(self, structure, c):
        free = [body for body in structure.bodies if body.free]
        force_measured = any(structure.bodies[k].fixed for k in structure.equations)
        of_one = WEIGHED if len(free) == 1 and not force_measured else 0.0
        return of_one + (LEFT_OUT if c < 0.0 else 0.0)

    def is_doubt(self, magnitudes, addition, c, shapes, fitted):
        return abs(c) < WEIGHED_TO * self._mass(magnitudes.structure, addition)

    @staticmethod
    def _mass(structure, addition):
        return structure.bodies[structure.body_index[addition.target]].mass
