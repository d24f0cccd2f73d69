"""A body's weight, which its accelerometer does not show."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...structure import EffectSpec
from ..effect import Addition, Effect
from ..estimator_model import coefficient_of, to_be_given, with_action

VERTICAL = "z"
"""Axis of the channels along which a body may fall (SAE J211: z is vertical)."""


@dataclass(frozen=True)
class Weight(Effect):
    """M c pushes a free body from time zero on, and its accelerometers show c less than it accelerates by."""

    acts_on: ClassVar[str] = "body"
    distorts: ClassVar[str] = "offset"
    balances_momentum: ClassVar[bool] = True

    def possible_targets(self, structure, test):
        return [body.name for body in structure.bodies if body.free and body.acceleration]

    def channels(self, structure, target):
        return structure.bodies[structure.body_index[target]].acceleration

    def course(self, variant, time):
        return -np.ones(np.shape(time))

    def put_to_work(self, structure, test, spec: EffectSpec):
        """Its force; the accelerometers' part is taken out of the samples: `core.effects.channels`."""
        if spec.coefficient is None:
            raise to_be_given(structure, spec, f"its coefficient, in {self.unit}")
        k = structure.body_index[spec.target]
        mass, c = structure.bodies[k].mass, coefficient_of(spec, self)
        scale = mass * self.size
        return with_action(structure, spec, self.unit, "body", k, c, scale, force=lambda t: np.full_like(t, mass))

    def body_load(self, addition, structure, time, inertial, **shapes):
        return addition.target, np.full_like(time, structure.bodies[structure.body_index[addition.target]].mass)

    def candidates(self, structure, magnitudes):
        """On bodies that move up or down."""
        test = magnitudes.records[0].test
        for name in self.possible_targets(structure, test):
            if all(test.channels[test.index(c)].axis == VERTICAL for c in self.channels(structure, name)):
                yield Addition(self, name)
