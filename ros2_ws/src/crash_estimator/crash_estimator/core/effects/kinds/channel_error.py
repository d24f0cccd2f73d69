"""How a channel differs from the true signal."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..effect import Addition, Effect
from ..estimator_model import ROUGHLY, coefficient_of, to_be_given, with_action

DRIFTED_AFTER = 0.1
"""s after the impact, about a crash's length: a zero that drifts has by then moved by the coefficient."""


PART = 0.05
"""Of a load cell's largest force, that its zero may be wrong by: as much as a gain."""


@dataclass(frozen=True)
class ChannelError(Effect):
    """How a channel differs from the true signal: recorded(t) = (1 + gain) true(t - delay) + offset.

    Its variants, of an offset: the zero has jumped at the impact (""), or it drifts from then on ("drift").
    """

    distorts: str = ""  # delay, gain or offset
    of_force: bool = False  # of measured forces only

    acts_on: ClassVar[str] = "channel"
    balances_momentum: ClassVar[bool] = True

    @property
    def variants(self):
        return ("", "drift") if self.distorts == "offset" else ("",)

    def course(self, variant, time):
        return time / DRIFTED_AFTER if variant == "drift" else np.ones(np.shape(time))

    def possible_targets(self, structure, test):
        measured = [body for body in structure.bodies if not body.derived]
        forces = [body.force for body in measured if body.force]
        return forces if self.of_force else [name for body in measured for name in body.acceleration] + forces

    def put_to_work(self, structure, test, spec):
        if spec.coefficient is not None:
            return structure  # taken out of the samples: `core.effects.channels`
        if self.distorts == "delay" or self.of_force or spec.variant:
            raise to_be_given(structure, spec, f"its coefficient, in {self.unit}")
        k, body = next((k, b) for k, b in enumerate(structure.bodies) if spec.target in (*b.acceleration, b.force))
        scale = self.size or ROUGHLY * (self.high if np.isfinite(self.high) else 1.0)
        unit = self.unit
        if body.fixed and self.distorts == "offset":
            scale, unit = scale * sum(b.mass or 0.0 for b in structure.bodies if b.free), "N"
        share = 1.0 / max(len(body.acceleration), 1)
        return with_action(structure, spec, unit, self.distorts, k, coefficient_of(spec, self), scale, share=share)

    def candidates(self, structure, magnitudes):
        """On channels whose errors show: of free bodies and driven ones, and measured forces."""
        balanced = [structure.bodies[k] for k in structure.equations]
        forces = [body.force for body in balanced if not body.free]
        moving = [body for body in balanced if body.free and not body.derived]
        felt = [name for body in moving + [b for b in structure.bodies if b.driven] for name in body.acceleration]
        shown = forces if self.of_force else felt if self.distorts == "offset" else felt + forces
        yield from (Addition(self, name, variant=variant) for name in shown for variant in self.variants)

    def prior_std(self, magnitudes, addition):
        """Of a measured force."""
        (body,) = (k for k, b in enumerate(magnitudes.structure.bodies) if b.force == addition.target)
        return PART * magnitudes.body_force[body]
