"""What is fitted: the parameters of a structure with its effects on some recordings, their priors and limits.

Parameters stand in this order: forces at the curves' knots, then constants of elements and effects and errors of the
masses, then for each recording the nuisances (errors and drifts of its outputs' zeros, slow errors of its driven
motions, errors of the velocities that it starts with, slow errors of applied forces, how late bodies touch).
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from crash_replay.onset import AS_WELL

from ...effects.effect import Addition
from ...effects.kinds.body_inertia import WEIGHED_TO
from ...effects.kinds.guide_force import GROUND
from ...structure import Coefficient, Structure
from ..observation.grid import ATTACHED_MODES, DRIVEN_MODES
from ..observation.pace import LONG
from ..observation.record import ObservedRecord, Output, comparable, outputs_of
from ..observation.trajectory import Trajectory
from .free_curve import ROUGHNESS, Curve, make_knots
from .magnitudes import Magnitudes
from .prior import LEAST_STD, Builder, Prior
from .terms import Link, Term

FREE, DRIVEN, FIXED = 0, 1, 2
"""How a body moves: by forces, as its channels say, or not at all. The compiled passes know these codes."""

DRIFT = 0.003
"""Of a channel's peak, standard deviation at the recording's end: the zero of an accelerometer that is shaken and warms
up drifts by some 0.15 g in a crash of 50 g. Ours: at 0.002 three of 120 looked-at models that lack nothing, whose zeros
drift by up to 0.2 g, were told an offset; at 0.003 none."""

BEYOND_DOUBT = 3.0
"""Standard deviations that such an error has at most: the usual three sigma. Halved, of 34 looked-at cases one
that lacks nothing, whose zeros drift, is told an offset; doubled, none is told otherwise. And of the noise in the band
that a channel has to pass to be rated: halved and doubled it changed nothing of what 36 looked-at cases were told."""

START_ERRS = 0.3
"""Of the velocity's standard deviation: wide, since a derivative at the end of a channel has half of the samples to go
by, and the recording itself says soon enough how the body started. Halved it changed nothing of 34 looked-at cases."""

FARTHEST = 2.0 * AS_WELL**0.5
"""Standard deviations that an onset may be off: twice as far as any that fits its signals as well. And that a signal's
mean may be off its zero where it is said to rest."""


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
    weighed = _weighed(b, structure) if records[0].in_doubt else {}
    common = len(b.parameters)
    outputs = comparable(outputs_of(structure), structure, records)
    offsets, drifts, modes, kicks, pushes, late = [], [], [], [], [], []
    driven = [(k, body.acceleration, DRIVEN_MODES) for k, body in enumerate(structure.bodies) if body.driven]
    driven += [(k, (channel,), ATTACHED_MODES) for channel, k in attached.items()]
    for r, record in enumerate(records):
        offsets.append(len(b.parameters))
        for q in range(len(outputs)):
            b.add("offset", 0.0, record.offset_std[q])
        drifts.append(_drifts(b, outputs, record) if record.in_doubt else {})
        modes.append(_modes(b, record, driven))
        kicks.append(_kicks(b, structure, magnitudes.measured[r]))
        slow = DRIVEN_MODES if record.time[-1] <= LONG else 0  # in a longer one they are slower than what moves
        pushed = [(k, (body.applied,), slow) for k, body in enumerate(structure.bodies) if body.applied]
        pushes.append(_modes(b, record, pushed))
        late.append(_late(b, record))
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
    if GROUND not in structure.body_index and any(one.effect.on_ground for one in additions):
        yield GROUND, FIXED


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
    if damping.estimated:
        rate = _constant(b, f"{element.name}.damping", damping, magnitudes.force[k] / magnitudes.rate[k])
    here = [_term(b, a, magnitudes) for a in additions if a.effect.acts_on == "element" and a.target == element.name]
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


def _weighed(b: Builder, structure: Structure) -> dict[int, int]:
    """Errors of the masses, where anything tells of them: of one body alone, M a = F hides a mass in the law."""
    free = [k for k, body in enumerate(structure.bodies) if body.free]
    told = len(free) > 1 or any(structure.bodies[k].fixed for k in structure.equations)
    return {k: _bounded(b, f"{structure.bodies[k].name}.mass", WEIGHED_TO) for k in free if told}


def _drifts(b: Builder, outputs: Sequence[Output], record: ObservedRecord) -> dict[int, int]:
    """Zeros at the recording's end, of the accelerometers."""
    felt = [q for q, output in enumerate(outputs) if output.quantity == "acceleration"]
    peak = np.nanmax(np.abs(record.measured), axis=0)
    return {q: _bounded(b, "drift", DRIFT * peak[q]) for q in felt}


def _bounded(b: Builder, name: str, std: float) -> int:
    """What a wrong model leaves is no reason for an error beyond its limits."""
    limit = BEYOND_DOUBT * max(std, LEAST_STD)
    return b.add(name, 0.0, std, low=-limit, high=limit)


def _modes(b: Builder, record: ObservedRecord, by: Iterable[tuple[int, Sequence[str], int]]) -> dict[int, range]:
    """Mean and so many slow cosines of the noise of channels whose mean moves or pushes a body: white noise spreads its
    variance evenly over them. Where there are none a force's zero errs as its rest says: with the noise's own mean the
    friction of an axis, recorded for 25 s, was told as 17.5 N for 20.4."""
    found, samples = {}, len(record.at)
    for k, channels, count in by:
        noise = np.sqrt(sum(record.signals[c].noise ** 2 for c in channels)) / len(channels)
        offset = np.sqrt(sum(record.signals[c].offset_std ** 2 for c in channels)) / len(channels)
        found[k] = range(len(b.parameters), len(b.parameters) + 1 + count)
        b.add("mode", 0.0, np.hypot(offset, noise / np.sqrt(samples)) if count else offset)
        for _ in range(count):
            b.add("mode", 0.0, noise * np.sqrt(2.0 / samples))
    return found


def _kicks(b: Builder, structure: Structure, measured: Trajectory) -> dict[int, int]:
    """Errors of the velocities that bodies start with, where these are derivatives at the very end of a channel."""
    own = (k for k, body in enumerate(structure.bodies) if body.starts_as_observed)
    return {k: b.add("kick", 0.0, START_ERRS * float(np.std(measured.v[:, k]))) for k in own}


def _late(b: Builder, record: ObservedRecord) -> int:
    """How late bodies touch that coast until then, where that is not known; not before the record begins."""
    limit = FARTHEST * record.impact_std
    return b.add("late", 0.0, record.impact_std, low=-limit, high=limit) if record.impact_std else -1
