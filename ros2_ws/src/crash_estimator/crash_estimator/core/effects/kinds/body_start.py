"""A body that starts faster or slower than the test says."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ...kinematics import initial_motion
from ..effect import Addition, Effect
from ..estimator_model import to_be_given

AS_FAST = 1e-6
"""Share by which velocities of bodies may differ that move as one before the impact: they are stated, not measured."""


@dataclass(frozen=True)
class BodyStart(Effect):
    """A body's velocity at time zero, and that of all that start as fast as it does: v0 = (1 + c) stated.

    Found in one test alone it belongs to that recording, not to the model.
    """

    acts_on: ClassVar[str] = "body"
    changes_start: ClassVar[bool] = True

    def possible_targets(self, structure, test):
        return [body.name for body in structure.bodies if not (body.fixed or body.starts_as_observed)]

    def put_to_work(self, structure, test, spec):
        if spec.coefficient is None:
            raise to_be_given(structure, spec, "its coefficient")
        faster = self.start_velocity(spec.target, structure.body_index, initial_motion(structure, test)[1]) != 0.0
        bodies = (
            replace(b, starts_faster=spec.coefficient) if at else b
            for b, at in zip(structure.bodies, faster, strict=True)
        )
        return replace(structure, bodies=tuple(bodies))

    def start_velocity(self, target, index, velocity):
        own = velocity[index[target]]
        return np.where(np.abs(velocity - own) <= AS_FAST * abs(own), velocity, 0.0)

    def candidates(self, structure, magnitudes) -> Iterator[Addition]:
        """For each velocity, where nothing else is derived from how a body moves: in all tests alike, or in one."""
        tests = [record.test.id for record in magnitudes.records]
        ways = ["", *tests] if len(set(tests)) == len(tests) > 1 else [""]
        seen = np.zeros(len(structure.bodies), bool)
        for k, name in enumerate(structure.body_index):
            group = self.start_velocity(name, structure.body_index, magnitudes.records[0].initial_velocity) != 0.0
            observed = any(structure.bodies[j].starts_as_observed for j in np.flatnonzero(group))
            if group[k] and not seen[k] and not observed:
                yield from (Addition(self, name, recording=test) for test in ways)
            seen |= group
