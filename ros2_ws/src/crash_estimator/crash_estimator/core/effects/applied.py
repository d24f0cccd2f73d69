"""Effects of a model put to work for the estimators: elements and masses where they have a place, else `Action`s.

A coefficient that the model gives is known; one that it does not give is estimated, sample by sample. What cannot be
followed that way (a gap, a delay) must be given: `diagnose --apply` writes it.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from crash_replay.recording import Test

from ..kinematics import initial_motion
from ..structure import (
    CONTACT_FREQUENCY,
    TYPICAL_CRUSH,
    TYPICAL_RATE,
    Action,
    Body,
    Coefficient,
    EffectSpec,
    Element,
    ModelError,
    Structure,
)  # fmt: skip
from . import EFFECTS
from .base import (
    AttachedBody,
    BodyForce,
    BodyInertia,
    ChannelError,
    Effect,
    ElementForce,
    ElementMotion,
    Gap,
    PairSpring,
    StaticFactor,
    UnloadingSlope,
)  # fmt: skip
from .targets import checked

ROUGHLY = 0.3
"""Share of a mass or of a force that an effect is taken to make up, for its order of magnitude."""


def applied(structure: Structure, test: Test, effects: Mapping[str, Effect] = EFFECTS) -> Structure:
    """The structure with its effects at work; without effects it is the same.

    Known errors of channels are not in it: `core.effects.channels` takes them out of the samples.
    Raises ModelError with one line where an effect does not fit, or needs a constant that is not given.
    """
    done = replace(structure, effects=())
    for spec in structure.effects:
        effect = checked(structure, spec, effects, test)
        spec = replace(spec, shape=_shape_constants(structure, spec, effect))
        done = _APPLY[_kind(effect)](done, test, spec, effect)
    return done


def _kind(effect: Effect) -> type[Effect]:
    for kind in _APPLY:
        if isinstance(effect, kind):
            return kind
    raise ModelError(
        f"effect {effect.name} is of no kind that can be put to work: {', '.join(kind.__name__ for kind in _APPLY)}"
    )


def _shape_constants(structure: Structure, spec: EffectSpec, effect: Effect) -> dict[str, float]:
    """Those given; for others the middle of where a diagnosis starts to search, unless that depends on the crush."""
    found = dict(spec.shape)
    for name, shape in effect.shapes.items():
        if name not in found and shape.of_crush:
            raise _to_be_given(structure, spec, f"its {name}, in {shape.unit}")
        found.setdefault(name, shape.starts[len(shape.starts) // 2])
    return found


def _to_be_given(structure: Structure, spec: EffectSpec, what: str) -> ModelError:
    return ModelError(
        f"model {structure.name}: effect {spec.type} on {spec.target} needs {what}, which no estimator can follow "
        "sample by sample: give it, or let `diagnose --apply` find it"
    )


def _coefficient(spec: EffectSpec, effect: Effect) -> Coefficient:
    if spec.coefficient is not None:
        return Coefficient(spec.coefficient)
    return Coefficient(0.0, estimated=True, min=effect.low, max=effect.high, drift=0.0, shape="constant")


def _with_action(
    structure: Structure, spec: EffectSpec, unit: str, kind: str, at: int, coefficient, scale, **more
) -> Structure:
    name = f"{spec.target}.{spec.type}"
    action = Action(name, unit, kind, at, coefficient, max(scale, abs(coefficient.value)), **more)
    return replace(structure, actions=(*structure.actions, action))


def _with_element(structure: Structure, name: str, **changes) -> Structure:
    return replace(
        structure, elements=tuple(replace(e, **changes) if e.name == name else e for e in structure.elements)
    )


def _element(structure: Structure, name: str) -> int:
    return next(k for k, element in enumerate(structure.elements) if element.name == name)


def _typical(structure: Structure, element: int) -> ElementMotion:
    """Beyond the typical crush as well: where a force that begins late, such as a stop's, is looked at."""
    crush = TYPICAL_CRUSH * 2.0 ** np.arange(6)
    rate = np.full_like(crush, TYPICAL_RATE)
    static = structure.reduced_mass(element) * CONTACT_FREQUENCY**2 * np.full_like(crush, TYPICAL_CRUSH)
    return ElementMotion(np.zeros_like(crush), crush, rate, crush, static)


def _element_force(structure: Structure, test: Test, spec: EffectSpec, effect: ElementForce) -> Structure:
    k, force = _element(structure, spec.target), partial(effect.force, **spec.shape)
    typical = _typical(structure, k)
    moved = np.abs(force(typical))
    scale = ROUGHLY * float(typical.static[0]) / float(moved[moved > 0.0][0] if moved.any() else 1.0)
    return _with_action(structure, spec, effect.unit, "element", k, _coefficient(spec, effect), scale, force=force)


def _static_factor(structure: Structure, test: Test, spec: EffectSpec, effect: StaticFactor) -> Structure:
    """Known: a property of the element. Estimated: c of 1 + c h(V), in which the force is linear."""
    k, h = _element(structure, spec.target), partial(effect.factor, **spec.shape)
    if spec.coefficient is None:
        scale = ROUGHLY / max(abs(float(h(np.array([TYPICAL_RATE]))[0])), 1e-9)
        return _with_action(structure, spec, "", "factor", k, _coefficient(spec, effect), scale, force=h)
    c, before = effect.unstated(spec.coefficient, **spec.shape), structure.elements[k].factor
    return _with_element(
        structure, spec.target, factor=lambda rate: (1.0 + c * h(rate)) * (1.0 if before is None else before(rate))
    )


def _gap(structure: Structure, test: Test, spec: EffectSpec, effect: Gap) -> Structure:
    if spec.coefficient is None:
        raise _to_be_given(structure, spec, f"its coefficient, in {effect.unit}")
    return _with_element(structure, spec.target, origin=spec.coefficient, tension=False)


def _unloading_slope(structure: Structure, test: Test, spec: EffectSpec, effect: UnloadingSlope) -> Structure:
    if spec.coefficient is not None:
        return _with_element(structure, spec.target, unloading=spec.coefficient, unloading_slope=None, tension=False)
    first = structure.reduced_mass(_element(structure, spec.target)) * CONTACT_FREQUENCY**2
    slope = replace(_coefficient(spec, effect), value=first)
    return _with_element(structure, spec.target, unloading=None, unloading_slope=slope, tension=False)


def _pair_spring(structure: Structure, test: Test, spec: EffectSpec, effect: PairSpring) -> Structure:
    """An element of its own; its crush counts from time zero, or from where its bodies' displacements are equal."""
    names = [body.name for body in structure.bodies]
    ends = next((a, b) for a in names for b in names if f"{a}-{b}" == spec.target)
    if spec.variant == "one_way_back":
        ends = ends[::-1]
    start = initial_motion(structure, test)[0]
    origin = 0.0 if spec.variant else float(start[names.index(ends[0])] - start[names.index(ends[1])])
    stiffness = replace(_coefficient(spec, effect), shape="constant")
    element = Element(spec.target, ends, stiffness, tension=not spec.variant.startswith("one_way"), origin=origin)
    return replace(structure, elements=(*structure.elements, element))


def _body_inertia(structure: Structure, test: Test, spec: EffectSpec, effect: BodyInertia) -> Structure:
    k = structure.body_index[spec.target]
    if spec.coefficient is not None:
        return _heavier(structure, k, spec.coefficient)
    scale = ROUGHLY * structure.bodies[k].mass
    return _with_action(structure, spec, effect.unit, "mass", k, _coefficient(spec, effect), scale)


def _heavier(structure: Structure, body: int, by: float) -> Structure:
    mass = structure.bodies[body].mass + by
    if mass <= 0.0:
        raise ModelError(
            f"model {structure.name}: its effects leave body {structure.bodies[body].name} no mass: {mass:g} kg"
        )
    return replace(
        structure, bodies=tuple(replace(b, mass=mass) if k == body else b for k, b in enumerate(structure.bodies))
    )


def _body_force(structure: Structure, test: Test, spec: EffectSpec, effect: BodyForce) -> Structure:
    k = structure.body_index[spec.target]
    scale = ROUGHLY * structure.bodies[k].mass * CONTACT_FREQUENCY**2 * TYPICAL_CRUSH
    return _with_action(structure, spec, effect.unit, "body", k, _coefficient(spec, effect), scale, force=effect.force)


def _attached_body(structure: Structure, test: Test, spec: EffectSpec, effect: AttachedBody) -> Structure:
    """A driven body that its host carries: the host feels - m a of it, and whatever else pushes it."""
    host = spec.host or next(body.name for body in structure.bodies if body.free)
    free = next(body.name for body in structure.bodies if body.free)
    starts_with = structure.body_index[spec.taken_from or (free if _body(structure, host).fixed else host)]
    start = tuple(float(values[starts_with]) for values in initial_motion(structure, test))
    body = Body(spec.target, acceleration=(spec.target,), driven=True, carried_by=host, start=start)
    elements = structure.elements
    if spec.touches:
        free_curve = Coefficient(0.0, estimated=True, min=0.0)
        name = f"{spec.touches}-{spec.target}"
        elements += (Element(name, (spec.touches, spec.target), free_curve, replace(free_curve, shape="constant")),)
    lighter = structure.body_index[spec.taken_from] if spec.taken_from else -1
    if spec.coefficient is not None and spec.taken_from:
        structure = _heavier(structure, lighter, -spec.coefficient)
    scale = ROUGHLY * max(body.mass or 0.0 for body in structure.bodies)
    structure = replace(structure, bodies=(*structure.bodies, body), elements=elements)
    return _with_action(
        structure, spec, effect.unit, "inertia", structure.body_index[host], _coefficient(spec, effect), scale,
        body=len(structure.bodies) - 1, lighter=lighter,
    )  # fmt: skip


def _body(structure: Structure, name: str) -> Body:
    return structure.bodies[structure.body_index[name]]


def _channel_error(structure: Structure, test: Test, spec: EffectSpec, effect: ChannelError) -> Structure:
    if spec.coefficient is not None:
        return structure  # taken out of the samples
    if effect.role == "delay":
        raise _to_be_given(structure, spec, "its coefficient, in s")
    k, body = next((k, b) for k, b in enumerate(structure.bodies) if spec.target in (*b.acceleration, b.force))
    scale = effect.size or ROUGHLY * (effect.high if np.isfinite(effect.high) else 1.0)
    unit = effect.unit
    if body.fixed and effect.role == "offset":
        scale, unit = scale * sum(b.mass or 0.0 for b in structure.bodies if b.free), "N"
    share = 1.0 / max(len(body.acceleration), 1)
    return _with_action(structure, spec, unit, effect.role, k, _coefficient(spec, effect), scale, share=share)


_APPLY = {
    ElementForce: _element_force,
    StaticFactor: _static_factor,
    Gap: _gap,
    UnloadingSlope: _unloading_slope,
    PairSpring: _pair_spring,
    BodyInertia: _body_inertia,
    BodyForce: _body_force,
    AttachedBody: _attached_body,
    ChannelError: _channel_error,
}
