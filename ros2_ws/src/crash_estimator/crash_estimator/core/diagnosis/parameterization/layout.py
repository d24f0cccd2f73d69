"""What is fitted: the parameters of a structure with its effects on some recordings, their priors and limits.

Parameters stand in this order: forces at the curves' knots, then constants of elements and effects and errors of the
masses, then for each recording the nuisances (errors and drifts of its outputs' zeros, slow errors of its driven
motions, errors of the velocities that it starts with, slow errors of applied forces, how late bodies touch).
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...effects.effect import Addition
from ...effects.kinds.guide_force import ground_of
from ...structure import Coefficient, Structure
from ..observation.grid import ATTACHED_MODES, DRIVEN_MODES
from ..observation.pace import LONG
from ..observation.record import ObservedRecord, Output, comparable, outputs_of
from . import nuisances
from .free_curve import ROUGHNESS, Curve, make_knots
from .magnitudes import Magnitudes
from .prior import Builder, Prior
from .terms import Link, Term

FREE, DRIVEN, FIXED = 0, 1, 2
"""How a body moves: by forces, as its channels say, or not at all. The compiled passes know these codes."""

REPLACED = 1e-4
"""Of its scale, standard deviation of a damping whose place an effect takes: as good as nothing. It stays a parameter,
as what was found with it is gone on from. Of two looked-at dampers with valves a tenth changed nothing, ten times of it
the sigmas, by 1.5 and 2."""


class Layout(NamedTuple):
    """A fit's parameters and what they mean."""

    structure: Structure
    links: tuple[Link, ...]
    bodies: tuple[str, ...]  # the structure's, then attached ones, then the ground where something slides on it
    kind: np.ndarray  # (b,) FREE, DRIVEN or FIXED
    outputs: tuple[Output, ...]
    knots: int  # parameters that are forces at knots
    common: int  # parameters before the nuisances
    size: int
    terms: tuple[Term, ...]  # of every addition, in their order
    attached: dict[str, int]  # channel of an attached body -> its body
    offsets: tuple[int, ...]  # per record: first of its outputs' zero-offset errors
    drifts: tuple[dict[int, int], ...]  # per record, in doubt: output that is an acceleration -> its zero at the end
    modes: tuple[dict[int, range], ...]  # per record: driven body -> its modes, the mean first
    kicks: tuple[dict[int, int], ...]  # per record: body that starts as its own channel says -> error of its velocity
    pushes: tuple[dict[int, range], ...]  # per record: body that a measured force is applied to -> its modes, N
    late: tuple[int, ...]  # per record: how late bodies touch that coast until then, s; -1: when they touch is known
    weighed: dict[int, int]  # in doubt: free body -> relative error of its mass
    prior: Prior
    start: np.ndarray  # (p,)
    names: tuple[str, ...]  # of the common parameters after the knots
    trusted: tuple[int, ...] = ()  # they stay as they start while a fit is held to the measured motion

    @property
    def stated(self) -> dict[int, float]:
        """Constant stiffnesses -> what the model file says of them, N/m."""
        links = (link for link in self.links if link.constant is not None)
        return {link.constant: link.known_stiffness for link in links if link.known_stiffness > 0.0}

    def link(self, name: str) -> Link:
        return next(link for link in self.links if link.name == name)

    def term(self, addition: Addition) -> Term:
        """That of an addition with the same effect and target: a model has no effect twice on one target."""
        return next(term for term in self.terms if term.addition.key == addition.key)


class Experiment(NamedTuple):
    """A recording under a layout: what the mechanics and the fit go through one after the other."""

    layout: Layout
    record: ObservedRecord
    index: int  # type: ignore[assignment]  # among the layout's recordings; hides the tuple's own method


def experiments_of(layout: Layout, records: Sequence[ObservedRecord]) -> tuple[Experiment, ...]:
    """Raises ValueError where the layout was made for another number of recordings."""
    if len(records) != len(layout.offsets):
        raise ValueError(f"a layout of {len(layout.offsets)} recordings, got {len(records)}")
    return tuple(Experiment(layout, record, index) for index, record in enumerate(records))


def make_layout(
    records: Sequence[ObservedRecord], magnitudes: Magnitudes, additions: Sequence[Addition],
    roughness: Mapping[str, np.ndarray] | None,
) -> Layout:  # fmt: skip
    """roughness: of curves, by their link's name, where it is not the usual one (`free_curve.adapted_roughness`)."""
    structure, roughness = magnitudes.structure, roughness or {}
    b = Builder()
    channels = dict.fromkeys(one.target for one in additions if one.attaches_body)
    attached = {channel: len(structure.bodies) + k for k, channel in enumerate(channels)}
    bodies, kind = zip(*_bodies(structure, attached, additions), strict=True)
    index = {name: k for k, name in reversed(list(enumerate(bodies)))}
    curves: list[Curve | None] = []
    for k, element in enumerate(structure.elements):
        wanted = element.stiffness.estimated and element.stiffness.shape == "curve"
        curves.append(_element_curve(b, k, element, magnitudes, roughness) if wanted else None)
    touching = []
    for addition in additions:
        if addition.attaches_body and addition.touches:
            at, crush = magnitudes.touching(addition)
            force = magnitudes.host_force(addition)
            name = _touch_name(addition)
            curve = b.curve(name, at, crush, force, roughness.get(name, ROUGHNESS), 0.0)
            touching.append((addition, curve))
    knots = len(b.parameters)
    links, terms = [], []
    starts = [record.initial_displacement for record in records]
    own = [addition.effect.own_link(addition, structure, index, starts) for addition in additions]
    beside = [addition for addition, link in zip(additions, own, strict=True) if link is None]
    for k, element in enumerate(structure.elements):
        links.append(_element_link(b, k, element, index, curves[k], magnitudes, beside, terms))
    for addition, link in zip(additions, own, strict=True):
        if link is not None:
            terms.append(_term(b, addition, magnitudes))
            term, name = terms[-1], f"{addition.target}.{addition.effect.name}"
            spring = {"constant": term.coefficient, "gap": term.shapes.get("gap")}
            what = spring if link.spring else {"terms": (term,)}
            links.append(Link(name, link.ends, link.ends, link.tension, origin=link.origin, **what))
    for addition, curve in touching:
        links.append(
            Link(
                _touch_name(addition),
                ends=(index[addition.touches], index[addition.host]),
                crush_ends=(index[addition.touches], attached[addition.target]),
                tension=True,
                curve=curve,
                damping=b.add(f"{_touch_name(addition)}.damping", 0.0, magnitudes.touching_damping(addition), low=0.0),
            )
        )
    placed = [term.addition for term in terms]
    terms += [_term(b, one, magnitudes) for one in additions if not any(one is other for other in placed)]
    terms.sort(key=lambda term: next(k for k, addition in enumerate(additions) if addition is term.addition))
    weighed = nuisances.weighed(b, structure) if records[0].in_doubt else {}
    common = len(b.parameters)
    outputs = comparable(outputs_of(structure), structure, records)
    offsets, drifts, modes, kicks, pushes, late = [], [], [], [], [], []
    driven = [(k, body.acceleration, DRIVEN_MODES) for k, body in enumerate(structure.bodies) if body.driven]
    driven += [(k, (channel,), ATTACHED_MODES) for channel, k in attached.items()]
    for r, record in enumerate(records):
        offsets.append(len(b.parameters))
        for q in range(len(outputs)):
            b.add("offset", 0.0, record.offset_std[q])
        drifts.append(nuisances.drifts(b, outputs, record) if record.in_doubt else {})
        modes.append(nuisances.modes(b, record, driven))
        kicks.append(nuisances.kicks(b, structure, magnitudes.measured[r]))
        slow = DRIVEN_MODES if record.time[-1] <= LONG else 0  # in a longer one they are slower than what moves
        pushed = [(k, (body.applied,), slow) for k, body in enumerate(structure.bodies) if body.applied]
        pushes.append(nuisances.modes(b, record, pushed))
        late.append(nuisances.late(b, record))
    return Layout(
        structure, tuple(links), bodies, np.array(kind), outputs, knots, common, len(b.parameters), tuple(terms),
        attached, tuple(offsets), tuple(drifts), tuple(modes), tuple(kicks), tuple(pushes), tuple(late), weighed,
        b.prior(), np.array([one.start for one in b.parameters]), tuple(one.name for one in b.parameters[knots:common]),
    )  # fmt: skip


def _bodies(structure: Structure, attached: Iterable[str], additions: Sequence[Addition]) -> Iterator[tuple[str, int]]:
    """The structure's own and their kinds, then attached ones, then the ground where something slides on it."""
    for body in structure.bodies:
        yield body.name, FREE if body.free else DRIVEN if body.driven else FIXED
    for channel in attached:
        yield channel, DRIVEN
    ground = ground_of(structure)
    if ground not in structure.body_index and any(one.effect.on_ground for one in additions):
        yield ground, FIXED


def _touch_name(addition: Addition) -> str:
    return f"{addition.touches}-{addition.target}"


def _element_curve(b: Builder, k: int, element, magnitudes: Magnitudes, roughness: Mapping[str, np.ndarray]) -> Curve:
    low, high = magnitudes.crush_range[k]
    crush = magnitudes.crush[k]
    knots = make_knots(low, high, crush, magnitudes.cells, element.tension)
    return b.curve(element.name, knots, crush, magnitudes.force[k], roughness.get(element.name, ROUGHNESS))


def _constant(b: Builder, name: str, coefficient: Coefficient, std: float) -> int:
    """A constant of an element; a fit begins with a tenth of its scale, where it acts already and claims little."""
    low, high = coefficient.min, coefficient.max
    return b.add(name, min(max(std * 0.1, low), high), std, low=low, high=high)


def _element_link(b, k, element, index, curve, magnitudes, additions, terms) -> Link:
    stiffness, damping = element.stiffness, element.damping
    constant = rate = None
    if stiffness.estimated and curve is None:
        # wide: what else carries beside it may push the other way, and a wide prior costs a nat. Halved, one gap of 60
        # looked-at cases was told as a stop; doubled, none was told otherwise
        constant = _constant(b, f"{element.name}.stiffness", stiffness, 3.0 * magnitudes.stiffness[k])
    own = [a for a in additions if a.effect.acts_on == "element" and a.target == element.name]
    if damping.estimated:
        replaced = any(a.effect.replaces(a.variant) == "damping" for a in own)
        scale = magnitudes.force[k] / magnitudes.rate[k] * (REPLACED if replaced else 1.0)
        rate = _constant(b, f"{element.name}.damping", damping, scale)
    here = [_term(b, addition, magnitudes) for addition in own]
    terms += here
    a, c = (index[end] for end in element.between)
    return Link(
        element.name,
        ends=(a, c),
        crush_ends=(-1, -1) if element.displacement else (a, c),
        tension=element.tension and not any(t.addition.effect.takes_tension_away(t.addition.variant) for t in here),
        damper_pulls=element.damper_pulls,
        acts_when_spent=element.acts_when_spent,
        curve=curve,
        constant=constant,
        known_stiffness=stiffness.value,
        damping=rate,
        known_damping=0.0 if damping.estimated else damping.value,
        unloading=element.unloading,
        displacement=element.displacement,
        velocity=element.velocity,
        terms=tuple(here),
    )


def _term(b: Builder, addition: Addition, magnitudes: Magnitudes) -> Term:
    """An effect's parameters: its coefficient, and the logarithms of its shape constants."""
    effect = addition.effect
    std = magnitudes.coefficient(addition)
    start = addition.coefficient if addition.coefficient is not None else 0.0
    low, high = effect.limits(magnitudes, addition)
    start = min(max(start, low), high)
    coefficient = b.add(f"{effect.name} {addition.target}", start, std, low=low, high=high)
    shapes = {}
    for name, shape in effect.shapes_of(addition.variant).items():
        unit = magnitudes.shape_unit(shape, addition.target)
        low, high = np.log(shape.low * unit), np.log(shape.high * unit)
        start = np.log(addition.shapes[name])
        even = (high - low) / np.sqrt(12.0)  # as a flat prior between the limits has
        shapes[name] = b.add(f"{effect.name} {addition.target} {name}", start, even, 0.5 * (low + high), low, high)
    return Term(addition, coefficient, shapes)
