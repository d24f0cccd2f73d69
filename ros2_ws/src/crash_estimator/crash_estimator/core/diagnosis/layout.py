"""What is fitted: the parameters of a structure with its effects on some recordings, their priors and limits.

Parameters stand in this order: forces at the curves' knots, then constants of elements and effects, then for each
recording the nuisances (zero-offset errors of its outputs, slow error of its driven motions).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..effects.base import AttachedBody, Effect, ElementForce, Gap, PairSpring, StaticFactor, UnloadingSlope
from ..structure import Coefficient, Structure
from .builder import Builder, Prior
from .curves import ROUGHNESS, Curve, make_knots
from .pairs import pair_of
from .propagate import DRIVEN, FIXED, FREE
from .records import DRIVEN_MODES, Record, outputs_of
from .scales import Scales


@dataclass(frozen=True)
class Addition:
    """An effect on a target: what is added to a structure."""

    effect: Effect
    target: str
    shapes: Mapping[str, float] = field(default_factory=dict)  # where the search starts, absolute
    coefficient: float | None = None  # likewise
    host: str | None = None  # unmodelled_body: the body that feels its inertia
    touches: str | None = None  # unmodelled_body: the body that it pushes by a free curve
    taken_from: str | None = None  # unmodelled_body: the free body whose mass it was counted in
    variant: str = ""  # load_path: see `VARIANTS`

    @property
    def key(self) -> tuple[str, str]:
        return self.effect.name, self.target


VARIANTS = ("", "absolute", "one_way", "one_way_back")
"""A load path carries both ways, its crush counted from time zero; or from where its bodies' displacements agree; or
compression only, with the second body before the first, or behind it."""


class Place(NamedTuple):
    """Where an addition's parameters are."""

    addition: Addition
    coefficient: int
    shapes: dict[str, int]


@dataclass(frozen=True)
class Link:
    """Something that carries a force: an element, or a load path. Numbers are parameters', None where there is none."""

    name: str
    ends: tuple[int, int]
    crush_ends: tuple[int, int]  # -1, -1: measured
    tension: bool
    pulls: bool = True  # without tension: a force beside the spring's may still be negative while that one is positive
    curve: Curve | None = None
    constant: int | None = None
    known_stiffness: float = 0.0
    damping: int | None = None
    known_damping: float = 0.0
    unloading: float | None = None  # known slope
    slope: int | None = None  # estimated slope instead
    gap: int | None = None
    origin: tuple[float, ...] = ()  # crush at time zero in each recording, where it counts from there
    displacement: str | None = None
    velocity: str | None = None
    forces: tuple[Place, ...] = ()
    factors: tuple[Place, ...] = ()
    trial: float = 0.0  # gap or slope of a law that is only tried out


class Layout(NamedTuple):
    """A fit's parameters and what they mean."""

    structure: Structure
    links: tuple[Link, ...]
    bodies: tuple[str, ...]  # the structure's, then attached ones
    kind: np.ndarray  # (b,) FREE, DRIVEN or FIXED
    outputs: tuple
    knots: int  # parameters that are forces at knots
    common: int  # parameters before the nuisances
    size: int
    places: tuple[Place, ...]  # of every addition
    attached: dict[str, int]  # channel of an attached body -> its body
    offsets: tuple[int, ...]  # per record: first of its outputs' zero-offset errors
    modes: tuple[dict[int, int], ...]  # per record: driven body -> first of its modes
    prior: Prior
    start: np.ndarray  # (p,)
    names: tuple[str, ...]  # of the common parameters after the knots


def make_layout(
    structure: Structure, records: Sequence[Record], scales: Scales, additions: Sequence[Addition],
    roughness: Mapping[str, np.ndarray] | None = None,
) -> Layout:  # fmt: skip
    """roughness: of curves, by their link's name, where it is not the usual one (`curves.adapted_roughness`)."""
    roughness = roughness or {}
    b = Builder()
    index = structure.body_index
    bodies = [body.name for body in structure.bodies]
    kind = [FREE if body.free else DRIVEN if body.driven else FIXED for body in structure.bodies]
    curves: list[Curve | None] = []
    for k, element in enumerate(structure.elements):
        wanted = element.stiffness.estimated and element.stiffness.shape == "curve"
        curves.append(_element_curve(b, k, element, scales, roughness) if wanted else None)
    attached, touching = {}, []
    for addition in additions:
        if isinstance(addition.effect, AttachedBody):
            if addition.target not in attached:
                attached[addition.target] = len(bodies)
                bodies.append(addition.target)
                kind.append(DRIVEN)
            if addition.touches:
                knots, crush = scales.touching(addition)
                force = scales.host_force(addition)
                name = _touch_name(addition)
                curve = b.curve(name, knots, crush, force, roughness.get(name, ROUGHNESS), 0.0)
                touching.append((addition, curve))
    knots = len(b.start)
    links, places = [], []
    for k, element in enumerate(structure.elements):
        links.append(_element_link(b, k, element, index, curves[k], scales, additions, places))
    for addition in additions:
        if isinstance(addition.effect, PairSpring):
            links.append(_pair_link(b, addition, index, records, scales, places))
    for addition, curve in touching:
        links.append(
            Link(
                _touch_name(addition),
                ends=(index[addition.touches], index[addition.host]),
                crush_ends=(index[addition.touches], attached[addition.target]),
                tension=True,
                curve=curve,
                damping=b.add(f"{_touch_name(addition)}.damping", 0.0, scales.touching_damping(addition), low=0.0),
            )
        )
    placed = {id(place.addition) for place in places}
    places += [_place(b, addition, scales) for addition in additions if id(addition) not in placed]
    common = len(b.start)
    outputs = outputs_of(structure)
    offsets, modes = [], []
    for r, record in enumerate(records):
        offsets.append(len(b.start))
        for q in range(len(outputs)):
            b.add("offset", 0.0, max(record.offset_std[q], 1e-9))
        modes.append(_modes(b, structure, record, attached))
    return Layout(
        structure, tuple(links), tuple(bodies), np.array(kind), outputs, knots, common, len(b.start), tuple(places),
        attached, tuple(offsets), tuple(modes), b.prior(), np.array(b.start), tuple(b.names[knots:common]),
    )  # fmt: skip


def _touch_name(addition: Addition) -> str:
    return f"{addition.touches}-{addition.target}"


def _element_curve(b: Builder, k: int, element, scales: Scales, roughness: Mapping[str, np.ndarray]) -> Curve:
    low, high = scales.crush_range[k]
    crush = scales.crush[k]
    one_way = not element.tension
    knots = make_knots(low, high, crush, scales.cells, tension=not one_way)
    return b.curve(element.name, knots, crush, scales.force[k], roughness.get(element.name, ROUGHNESS))


def _constant(b: Builder, name: str, coefficient: Coefficient, std: float) -> int:
    low, high = coefficient.min, coefficient.max
    return b.add(name, min(max(std * 0.1, low), high), std, low=low, high=high)


def _element_link(b, k, element, index, curve, scales, additions, places) -> Link:
    stiffness, damping = element.stiffness, element.damping
    mine = [a for a in additions if a.target == element.name]
    constant = rate = None
    if stiffness.estimated and curve is None:
        constant = _constant(b, f"{element.name}.stiffness", stiffness, 3.0 * scales.stiffness[k])
    if damping.estimated:
        rate = _constant(b, f"{element.name}.damping", damping, scales.force[k] / scales.rate[k])
    here = {id(a): _place(b, a, scales) for a in mine}
    places += here.values()

    def placed(kind: type[Effect]) -> tuple[Place, ...]:
        return tuple(here[id(a)] for a in mine if isinstance(a.effect, kind))

    gap, slope = placed(Gap), placed(UnloadingSlope)
    a, c = (index[end] for end in element.between)
    return Link(
        element.name,
        ends=(a, c),
        crush_ends=(-1, -1) if element.displacement else (a, c),
        tension=element.tension and not gap and not slope,
        pulls=scales.pulls,
        curve=curve,
        constant=constant,
        known_stiffness=stiffness.value,
        damping=rate,
        known_damping=0.0 if damping.estimated else damping.value,
        unloading=element.unloading,
        slope=slope[0].coefficient if slope else None,
        gap=gap[0].coefficient if gap else None,
        displacement=element.displacement,
        velocity=element.velocity,
        forces=placed(ElementForce),
        factors=placed(StaticFactor),
    )


def _pair_link(b, addition, index, records, scales, places) -> Link:
    ends = pair_of(addition.target, index)
    place = _place(b, addition, scales)
    places.append(place)
    if addition.variant == "one_way_back":
        ends = ends[::-1]
    start = [record.initial_displacement for record in records]
    origin = () if addition.variant else tuple(float(x[ends[0]] - x[ends[1]]) for x in start)
    return Link(
        addition.target,
        ends,
        ends,
        not addition.variant.startswith("one_way"),
        constant=place.coefficient,
        origin=origin,
    )


def _place(b: Builder, addition: Addition, scales: Scales) -> Place:
    """An effect's parameters: its coefficient, and the logarithms of its shape constants."""
    effect = addition.effect
    std = scales.coefficient(addition)
    start = addition.coefficient if addition.coefficient is not None else 0.0
    low = 0.3 * scales.stiffness[scales.element(addition.target)] if isinstance(effect, UnloadingSlope) else effect.low
    start = min(max(start, low), effect.high)
    coefficient = b.add(f"{effect.name} {addition.target}", start, std, low=low, high=effect.high)
    shapes = {}
    for name, shape in effect.shapes.items():
        unit = scales.largest_crush(addition.target) if shape.of_crush else 1.0
        low, high = np.log(shape.low * unit), np.log(shape.high * unit)
        start = np.log(addition.shapes[name])
        shapes[name] = b.add(
            f"{effect.name} {addition.target} {name}",
            start,
            (high - low) / np.sqrt(12.0),
            0.5 * (low + high),
            low,
            high,
        )
    return Place(addition, coefficient, shapes)


def _modes(b: Builder, structure: Structure, record: Record, attached: dict[str, int]) -> dict[int, int]:
    """Mean and slow cosines of each driven channel's noise; white noise spreads its variance evenly over them."""
    found = {}
    driven = [(k, body.acceleration) for k, body in enumerate(structure.bodies) if body.driven]
    samples = len(record.at)
    for k, channels in driven + [(k, (channel,)) for channel, k in attached.items()]:
        noise = np.sqrt(sum(record.signals[c].noise ** 2 for c in channels)) / len(channels)
        offset = np.sqrt(sum(record.signals[c].offset_std ** 2 for c in channels)) / len(channels)
        found[k] = len(b.start)
        b.add("mode", 0.0, max(np.hypot(offset, noise / np.sqrt(samples)), 1e-9))
        for _ in range(DRIVEN_MODES):
            b.add("mode", 0.0, max(noise * np.sqrt(2.0 / samples), 1e-9))
    return found
