"""A body that the model has not got: it moves as an unused acceleration channel shows, or hangs on one that it has."""

from dataclasses import dataclass, replace
from itertools import combinations, product
from typing import ClassVar

import numpy as np

from ...kinematics import initial_motion
from ...structure import Body, Coefficient, Element, ModelError, Structure
from ..effect import Addition, Effect
from ..estimator_model import ROUGHLY, coefficient_of, heavier, with_action
from .body_inertia import WEIGHED_TO

AT_LIMIT = 1e-3
"""Share of a limit by which a fit that ends there may miss it."""

HUNG = "hung"
"""Form of one without a sensor: a spring and a damper join it to the body that is the target."""


@dataclass(frozen=True)
class AttachedBody(Effect):
    """A body that the model has not got, moving as an unused acceleration channel shows, or in the form `hung` as what
    hangs on a body of the model does; the coefficient: its mass."""

    acts_on: ClassVar[str] = "channel"
    balances_momentum: ClassVar[bool] = True

    def target_key(self, variant):
        return "body" if variant == HUNG else self.acts_on

    def attaches_body(self, variant):
        return variant != HUNG

    def possible_targets(self, structure, test):
        if test is None:
            return None
        used = [name for body in structure.bodies for name in (*body.acceleration, body.force) if name]
        unused = [c.name for c in test.channels if c.quantity == "acceleration" and c.name not in used]
        return unused + [body.name for body in structure.bodies if body.free]

    def refuse(self, structure, spec):
        on_body = any(body.free and body.name == spec.target for body in structure.bodies)
        if on_body != (spec.variant == HUNG):
            needs = f"`form: {HUNG}`, or a channel" if on_body else "a free body in this form"
            raise ModelError(f"model {structure.name}: effect {spec.type} on {spec.target} needs {needs}")

    def put_to_work(self, structure, test, spec):
        """A driven body that its host carries: the host feels - m a of it, and whatever else pushes it."""
        free = next(body.name for body in structure.bodies if body.free)
        host = spec.target if spec.variant == HUNG else spec.host or free
        starts_with = structure.body_index[spec.taken_from or (free if _body(structure, host).fixed else host)]
        start = tuple(float(values[starts_with]) for values in initial_motion(structure, test))
        body = Body(spec.target, acceleration=(spec.target,), driven=True, carried_by=host, start=start)
        if spec.variant == HUNG:
            follows, hangs = _body(structure, host).acceleration, tuple(spec.shape[name] for name in self.shapes)
            body = replace(body, name=f"{host}.{spec.type}", acceleration=follows, hangs=hangs)
        elements = structure.elements
        if spec.touches:
            free_curve = Coefficient(0.0, estimated=True, min=0.0)
            name = f"{spec.touches}-{spec.target}"
            elements += (Element(name, (spec.touches, spec.target), free_curve, replace(free_curve, shape="constant")),)
        lighter = structure.body_index[spec.taken_from] if spec.taken_from else -1
        if spec.coefficient is not None and spec.taken_from:
            structure = heavier(structure, lighter, -spec.coefficient)
        scale = ROUGHLY * max(body.mass or 0.0 for body in structure.bodies)
        structure = replace(structure, bodies=(*structure.bodies, body), elements=elements)
        return with_action(
            structure, spec, self.unit, "inertia", structure.body_index[host], coefficient_of(spec, self), scale,
            body=len(structure.bodies) - 1, lighter=lighter,
        )  # fmt: skip

    def mass_shares(self, addition):
        return {addition.taken_from: -1.0} if addition.taken_from else {}

    def body_load(self, addition, structure, time, inertial, **shapes):
        if addition.variant != HUNG:
            return addition.host, -inertial(addition.target)
        from ...hung_body import hung  # the compiler takes long to import: only who needs it waits for it

        steps = np.diff(time, prepend=time[0])
        return addition.target, -hung(steps, inertial(addition.target), (0.0, 0.0), **shapes)[0]

    def candidates(self, structure, magnitudes):
        """On every unused channel of the axis: what feels the body's inertia, and whether its mass was counted in; or,
        without any such channel, what hangs on every body whose acceleration is measured."""
        unused = _unused(structure, magnitudes)
        if "" in self.forms:
            yield from self._on_channels(structure, unused)
        # where its acceleration is all that is measured, it may as well be a sensor off the centre of what rotates
        if HUNG in self.forms and not unused and len(structure.equations) > 1:
            yield from self._hanging(structure)

    def _on_channels(self, structure, channels):
        for channel in channels:
            for host in structure.bodies:
                if host.free or (host.fixed and host.force):
                    yield Addition(self, channel, host=host.name)
                    owners = _neighbours(structure, host) if host.fixed else [host.name]
                    for owner in owners:
                        if _body(structure, owner).free:
                            yield Addition(self, channel, host=host.name, taken_from=owner)

    def _hanging(self, structure):
        """From each of the starts, with the mass counted in its host's and not."""
        for body in structure.bodies:
            if body.free and body.acceleration:
                for starts in product(*(shape.starts for shape in self.shapes.values())):
                    shapes = dict(zip(self.shapes, starts, strict=True))
                    one = Addition(self, body.name, shapes, host=body.name, variant=HUNG)
                    yield from (one, replace(one, taken_from=body.name))

    def limits(self, magnitudes, addition):
        """What hangs on a body is the lighter one of the two."""
        low, high = super().limits(magnitudes, addition)
        return low, _body(magnitudes.structure, addition.target).mass if addition.variant == HUNG else high

    def is_doubt(self, magnitudes, addition, c, shapes, fitted):
        """What hangs and does not swing, at the limit of a shape constant, is something else that is slow; and a body's
        mass is not known to that share."""
        if addition.variant != HUNG:
            return False
        inside = all(
            one.low < (1.0 - AT_LIMIT) * shapes[name] and (1.0 + AT_LIMIT) * shapes[name] < one.high
            for name, one in self.shapes.items()
        )
        return not inside or c < WEIGHED_TO * _body(magnitudes.structure, addition.target).mass

    def prior_std(self, magnitudes, addition):
        structure = magnitudes.structure
        if addition.variant == HUNG:
            return ROUGHLY * _body(structure, addition.target).mass
        return ROUGHLY * sum(body.mass for body in structure.bodies if body.free)

    def extensions(self, structure, addition):
        """The same body between its host and each one that an element joins to the host, pushed by a free curve; or one
        that hangs, with its mass counted in its host's, or not."""
        if addition.variant == HUNG:
            return [replace(addition, taken_from=None if addition.taken_from else addition.target)]
        return [replace(addition, touches=name) for name in _neighbours(structure, _body(structure, addition.host))]


def _unused(structure: Structure, magnitudes) -> list[str]:
    """Acceleration channels of the model's axis that it does not use, that move by more than twice their noise, and
    that are on no body whose mass it has; of two that agree to the last bit one."""
    used = {name for _, name, _ in structure.channels()}
    weighed = {body.name for body in structure.bodies if body.free}
    channels, (signals, *others) = magnitudes.records[0].test.channels, [one.signals for one in magnitudes.records]
    axes = {channel.axis for channel in channels if channel.name in used}
    of_axis = [c for c in channels if c.quantity == "acceleration" and c.axis in axes]
    shown = [c for c in of_axis if all(c.name in each for each in (signals, *others))]
    moving = [c for c in shown if np.std(signals[c.name].on_grid) > 2.0 * signals[c.name].noise]
    unused = [c.name for c in moving if c.name not in used and c.body not in weighed]
    copies = {b for a, b in combinations(unused, 2) if np.array_equal(signals[a].values, signals[b].values)}
    return [name for name in unused if name not in copies]


def _body(structure: Structure, name: str) -> Body:
    return structure.bodies[structure.body_index[name]]


def _neighbours(structure: Structure, body: Body) -> list[str]:
    """The bodies that an element joins to a body."""
    ends = [set(element.between) - {body.name} for element in structure.elements if body.name in element.between]
    joined = {name for end in ends for name in end}
    return [other.name for other in structure.bodies if other.name in joined]
