"""Everything that may be missing: the vocabulary's effects on all targets where they can be told at all."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations, product

import numpy as np

from ..effects.base import (
    AttachedBody,
    BodyForce,
    BodyInertia,
    ChannelError,
    Effect,
    ElementForce,
    Gap,
    PairSpring,
    StaticFactor,
    UnloadingSlope,
)
from ..structure import Body, Element, Structure
from .layout import Addition
from .records import outputs_of
from .scales import Scales

GAP_STARTS = (0.05, 0.12, 0.25, 0.45)
"""Shares of the largest crush."""

SLOPE_STARTS = (1.0, 2.5, 6.0)
"""In stiffness scales of the element; in the model's own slope where it has one: 0.6 and 1.8."""


def candidates(
    structure: Structure, scales: Scales, effects: Mapping[str, Effect], present: Sequence[Addition] = ()
) -> list[Addition]:
    """Every admissible addition, several with the same effect and target where the search has several starts."""
    taken = {addition.key for addition in present}
    found = [a for effect in effects.values() for a in _on_targets(structure, scales, effect)]
    sensed = {_carrier(scales, addition.target) for addition in present if isinstance(addition.effect, AttachedBody)}
    return [
        addition
        for addition in found
        if addition.key not in taken
        and not (isinstance(addition.effect, AttachedBody) and _carrier(scales, addition.target) in sensed)
    ]


def _carrier(scales: Scales, channel: str) -> str:
    """The body that a channel's sensor sits on: with two sensors it is still one body."""
    test = scales.records[0].test
    return test.channels[test.index(channel)].body or channel


def _on_targets(structure: Structure, scales: Scales, effect: Effect) -> Iterator[Addition]:
    match effect:
        case ElementForce() | StaticFactor() | Gap() | UnloadingSlope():
            for k, element in enumerate(structure.elements):
                if scales.crush_range[k, 1] > 0.0:
                    yield from _on_element(scales, effect, k, element)
        case PairSpring():
            yield from _between_pairs(structure, scales, effect)
        case BodyInertia() | BodyForce():
            for body in structure.bodies:
                if body.free:
                    yield Addition(effect, body.name)
        case ChannelError():
            yield from (Addition(effect, channel) for channel in _channels(structure, effect.role != "offset"))
        case AttachedBody():
            yield from _attached(structure, scales, effect)


def _on_element(scales: Scales, effect: Effect, k: int, element: Element) -> Iterator[Addition]:
    free_curve = element.stiffness.estimated and element.stiffness.shape == "curve"
    largest = scales.largest_crush(element.name)
    match effect:
        case Gap():
            for share in GAP_STARTS:
                yield Addition(effect, element.name, coefficient=share * largest)
        case UnloadingSlope():
            known = element.unloading
            slopes = [0.6 * known, 1.8 * known] if known else [s * scales.stiffness[k] for s in SLOPE_STARTS]
            for slope in slopes:
                yield Addition(effect, element.name, coefficient=slope)
        case ElementForce() if effect.of_crush_only and free_curve and not element.unloading:
            return
        case ElementForce() if effect.name == "viscous_damping" and element.damping.estimated:
            return
        case _:
            names = list(effect.shapes)
            for values in product(*(effect.shapes[name].starts for name in names)):
                unit = [largest if effect.shapes[name].of_crush else 1.0 for name in names]
                yield Addition(effect, element.name, {n: v * u for n, v, u in zip(names, values, unit)})


def _between_pairs(structure: Structure, scales: Scales, effect: Effect) -> Iterator[Addition]:
    """Both ways, counted from time zero or not, and one way where the bodies come close enough to touch."""
    joined = {frozenset(element.between) for element in structure.elements}
    starts = [record.initial_displacement for record in scales.records]
    for (i, a), (k, b) in combinations(enumerate(structure.bodies), 2):
        if frozenset((a.name, b.name)) in joined or not (a.free or b.free):
            continue
        apart = any(abs(x[i] - x[k]) > 0.0 for x in starts)
        crush = np.concatenate([motion.x[:, i] - motion.x[:, k] for motion in scales.measured])
        yield Addition(effect, f"{a.name}-{b.name}")
        if apart:
            yield Addition(effect, f"{a.name}-{b.name}", variant="absolute")
        for variant, reach in (("one_way", crush), ("one_way_back", -crush)):
            if reach.max() > 0.0 and reach.min() < 0.0:
                yield Addition(effect, f"{a.name}-{b.name}", variant=variant)


def _channels(structure: Structure, forces: bool) -> list[str]:
    """Channels whose errors show: of free bodies and driven ones, and measured forces."""
    outputs = [output.channel for output in outputs_of(structure) if forces or not output.fixed]
    driven = [name for body in structure.bodies if body.driven for name in body.acceleration]
    return outputs + driven


def _attached(structure: Structure, scales: Scales, effect: Effect) -> Iterator[Addition]:
    """On every unused channel of the model's axis: what feels the body's inertia, and if its mass was counted in."""
    used = {name for _, name, _ in structure.channels()}
    test = scales.records[0].test
    axes = {channel.axis for channel in test.channels if channel.name in used}
    unused = [c.name for c in test.channels if c.quantity == "acceleration" and c.axis in axes and c.name not in used]
    signals = scales.records[0].signals
    copies = {b for a, b in combinations(unused, 2) if np.array_equal(signals[a].values, signals[b].values)}
    unused = [name for name in unused if name not in copies]
    for channel in unused:
        for host in structure.bodies:
            if host.free or (host.fixed and host.force):
                yield Addition(effect, channel, host=host.name)
                owners = _neighbours(structure, host) if host.fixed else [host.name]
                for owner in owners:
                    if structure.bodies[structure.body_index[owner]].free:
                        yield Addition(effect, channel, host=host.name, taken_from=owner)


def touching(structure: Structure, addition: Addition) -> list[Addition]:
    """The same unmodelled body between its host and each body that an element joins to the host, pushed by a curve."""
    host = structure.bodies[structure.body_index[addition.host]]
    return [replace(addition, touches=name) for name in _neighbours(structure, host)]


def _neighbours(structure: Structure, body: Body) -> list[str]:
    """The bodies that an element joins to a body."""
    ends = [set(element.between) - {body.name} for element in structure.elements if body.name in element.between]
    joined = {name for end in ends for name in end}
    return [other.name for other in structure.bodies if other.name in joined]
