"""The hidden effects, each in the forms in which engineers write it, and which answers are right.

Right answers are written here, before anybody is asked: the effect by the name that the project's README gives it, and
other names of the same law. Nothing here knows what a diagnosis finds easy.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import inf

from . import branches, sizes
from .sizes import Base
from .structures import Rng, Setup

Answer = tuple[str, str]
"""An effect and its target; of two bodies in the order of the alphabet."""


@dataclass(frozen=True)
class Wrong:
    """What is wrong with one channel."""

    kind: str  # offset, drift, gain, misaligned, delay, lowpass
    size: float


@dataclass(frozen=True)
class Hidden:
    """A structure with something hidden in it, and the answers that are right, written down before anybody is asked."""

    setup: Setup
    right: tuple[Answer, ...]
    wrong: Mapping[str, Wrong]  # channel -> what is wrong with it
    gap: float = 0.0  # m: a stop at this crush with nothing before it is the same law as the gap (within 5 %)


@dataclass(frozen=True)
class Form:
    effect: str
    targets: Mapping[str, tuple[str, ...]]  # by structure
    hide: Callable[[Base], Setup]
    also: tuple[str, ...] = ()  # other names of the same law, on the same target
    straight: bool = False  # all elements of one stiffness: a free curve would contain it
    elastic: bool = False
    lined: bool = False
    outside: bool = False


CONTACTS = {
    "wall": ("car_barrier",),
    "cab": ("cab_barrier", "engine_barrier"),
    "side": ("door_rib",),
    "sled": ("impactor_block",),
}
TWO_WAY = {"side": ("rib_spine",), "sled": ("block_sled",)}
ELEMENTS = {name: (*CONTACTS[name], *TWO_WAY.get(name, ())) for name in CONTACTS}
SEATED = {name: CONTACTS[name] for name in ("side", "sled")}
BODIES = {"cab": ("cab", "engine"), "side": ("rib", "spine"), "sled": ("impactor", "block", "sled")}
"""Without the one mass before a barrier: its mass, its gain and the barrier's are one factor, and a delay is hardly
seen."""

PUSHED = {"wall": ("car",), **BODIES}
STRIKING = {"wall": ("car",), "cab": ("cab",), "sled": ("impactor",)}
PATHS = {"side": ("door-spine",), "sled": ("impactor-sled",)}


FORMS: dict[str, Form] = {
    "friction.stick": Form(
        "coulomb_friction", ELEMENTS, sizes.beside(lambda b: branches.DryFriction(b.share() * b.peak.f))
    ),
    "friction.tanh": Form(
        "coulomb_friction",
        ELEMENTS,
        sizes.beside(lambda b: branches.TanhFriction(b.share() * b.peak.f, 0.02 * b.peak.v)),
    ),
    "friction.dahl": Form(
        "coulomb_friction",
        ELEMENTS,
        sizes.beside(lambda b: branches.Dahl(b.share() * b.peak.f, 0.01 * b.peak.x)),
        ("hysteresis",),
    ),
    "friction.lugre": Form("coulomb_friction", ELEMENTS, sizes.beside(sizes.lugre), ("hysteresis",)),
    "friction.seat": Form("coulomb_friction", SEATED, sizes.seat),
    "stop.beside": Form(
        "bottoming_out", CONTACTS, sizes.beside(lambda b: branches.SpringBeside(sizes.stop(b))), straight=True
    ),
    "stop.inside": Form("bottoming_out", CONTACTS, sizes.inside(sizes.stop), straight=True, lined=True),
    "stop.hertz": Form(
        "bottoming_out", ELEMENTS, sizes.beside(lambda b: branches.SpringBeside(sizes.stop(b, 1.5))), straight=True
    ),
    "cubic.beside": Form(
        "cubic_stiffness",
        ELEMENTS,
        sizes.beside(lambda b: branches.SpringBeside(sizes.cubic(b), not b.joint.one_way)),
        straight=True,
    ),
    "cubic.inside": Form("cubic_stiffness", CONTACTS, sizes.inside(sizes.cubic), straight=True, lined=True),
    "limit.flat": Form("yielding", CONTACTS, sizes.changed(sizes.limited), straight=True, elastic=True),
    "limit.line": Form("yielding", CONTACTS, sizes.changed(sizes.limited), straight=True, lined=True),
    "limit.plastic": Form("yielding", CONTACTS, sizes.changed(sizes.bent), straight=True, elastic=True),
    "limit.knee": Form("yielding", ELEMENTS, sizes.changed(sizes.kneed), straight=True, elastic=True),
    "limit.foam": Form("yielding", CONTACTS, sizes.changed(sizes.foamy), straight=True),
    "gap.one": Form(
        "clearance", CONTACTS, sizes.changed(lambda b: {"gap": b.share(0.08, 0.2) * b.peak.x}), straight=True
    ),
    "gap.both": Form(
        "clearance", TWO_WAY, sizes.changed(lambda b: {"gap": b.share(0.08, 0.2) * b.peak.x}), straight=True
    ),
    "damper.linear": Form(
        "viscous_damping",
        ELEMENTS,
        sizes.beside(lambda b: branches.Dashpot(b.share(0.2, 0.4) * b.peak.f / b.peak.v), pulls=True),
    ),
    "damper.contact": Form(
        "viscous_damping", CONTACTS, sizes.beside(lambda b: branches.Dashpot(b.share(0.2, 0.4) * b.peak.f / b.peak.v))
    ),
    "damper.deepening": Form(
        "viscous_damping",
        CONTACTS,
        sizes.beside(lambda b: branches.DeepeningDashpot(b.share(0.5, 0.9) * b.peak.f / (b.peak.x * b.peak.v))),
    ),
    "damper.quadratic": Form(
        "quadratic_damping",
        ELEMENTS,
        sizes.beside(lambda b: branches.Orifice(b.share(0.2, 0.4) * b.peak.f / b.peak.v**2)),
    ),
    "damper.metered": Form("quadratic_damping", CONTACTS, sizes.beside(sizes.metered)),
    "rate.cowper": Form("rate_hardening", CONTACTS, sizes.changed(sizes.cowper)),
    "rate.power": Form("rate_hardening", CONTACTS, sizes.changed(sizes.power)),
    "rate.log": Form("rate_hardening", CONTACTS, sizes.changed(sizes.log)),
    "flow.maxwell": Form("maxwell_element", ELEMENTS, sizes.beside(sizes.maxwell)),
    "flow.prony": Form("maxwell_element", ELEMENTS, sizes.prony),
    "flow.gas": Form("gas_cushion", CONTACTS, sizes.beside(sizes.gas(1.4)), straight=True),
    "flow.isothermal": Form("gas_cushion", CONTACTS, sizes.beside(sizes.gas(1.0)), straight=True),
    "hysteresis.boucwen": Form(
        "hysteresis",
        ELEMENTS,
        sizes.beside(
            lambda b: branches.BoucWen(b.share() * b.peak.f, b.share(0.1, 0.25) * b.peak.x, b.share(1.0, 2.0), 0.5)
        ),
    ),
    "hysteresis.slider": Form(
        "hysteresis",
        ELEMENTS,
        sizes.beside(lambda b: branches.Slider(b.share() * b.peak.f, b.share(0.1, 0.25) * b.peak.x)),
    ),
    "hysteresis.line": Form("plastic_unloading", CONTACTS, sizes.changed(sizes.line), ("hysteresis",), elastic=True),
    "mass.rigid": Form("added_mass", BODIES, sizes.heavier),
    "mass.mounted": Form("added_mass", BODIES, sizes.carried, ("unmodelled_body",)),
    "mass.hung": Form("unmodelled_body", BODIES, sizes.hung),
    "path.linear": Form("load_path", PATHS, sizes.path("linear")),
    "path.slack": Form("load_path", PATHS, sizes.path("slack")),
    "path.curved": Form("load_path", PATHS, sizes.path("curved")),
    "force.constant": Form("constant_force", PUSHED, sizes.push(0.0)),
    "force.rising": Form("constant_force", PUSHED, sizes.push(0.005)),
    "body.engine": Form("unmodelled_body", {"cab": ("engine",)}, sizes.engine),
    # a constant force is the same law until the body comes back
    "force.guide": Form("guide_friction", PUSHED, sizes.guided, ("constant_force",), straight=True),
    "speed.stated": Form("initial_velocity", STRIKING, sizes.misstated),
    "channel.offset": Form("channel_offset", PUSHED, sizes.as_it_is),
    "channel.drift": Form("channel_offset", PUSHED, sizes.as_it_is),
    "channel.gain": Form("channel_gain", BODIES, sizes.as_it_is),
    "channel.misaligned": Form("channel_gain", BODIES, sizes.as_it_is),
    "channel.delay": Form("channel_delay", BODIES, sizes.as_it_is),
    "channel.lowpass": Form("channel_delay", BODIES, sizes.as_it_is),
    "outside.losing": Form("losing_mass", BODIES, sizes.losing, outside=True),
    "outside.folding": Form("folding", CONTACTS, sizes.folding, straight=True, outside=True),
    "outside.running": Form("running", BODIES, sizes.running, outside=True),
    "outside.breaking": Form("breaking", ELEMENTS, sizes.beside(sizes.breaking), straight=True, outside=True),
    "outside.rattling": Form("rattling", BODIES, sizes.rattling, outside=True),
}


def wrong_channel(kind: str, rng: Rng) -> Wrong:
    sign = 1.0 if rng.random() < 0.5 else -1.0
    size = {
        "offset": sign * rng.uniform(1.5, 4.5), "drift": sign * rng.uniform(2.5, 4.8),  # g
        "gain": 1.0 + sign * rng.uniform(0.04, 0.09),
        "misaligned": rng.uniform(17.0, 24.0),  # degrees: 4 to 9 % less
        "delay": rng.uniform(0.3e-3, 0.8e-3), "lowpass": rng.uniform(300.0, 700.0),  # s; Hz: 0.3 to 0.75 ms late
    }[kind]  # fmt: skip
    return Wrong(kind, float(size))


def hide(name: str, base: Base) -> Hidden:
    """The form `name` in the structure that it is given; raises KeyError where there is no such form."""
    form = FORMS[name]
    family, kind = name.split(".")
    base = base._replace(setup=replace(base.setup, plain=base.setup.joints, masses=_masses(base.setup)))
    setup = form.hide(base)
    channel = f"{base.target}_a{setup.axis}"
    if family == "channel":
        return Hidden(setup, ((form.effect, channel),), {channel: wrong_channel(kind, base.rng)})
    if form.outside:
        return Hidden(setup, (), {})
    target = channel if family == "body" else "-".join(sorted(base.target.split("-")))
    right = tuple((effect, target) for effect in (form.effect, *form.also))
    return Hidden(setup, right, {}, setup.joints[base.target].gap if name == "gap.one" else 0.0)


def _masses(setup: Setup) -> dict[str, float]:
    return {body.name: body.mass for body in setup.bodies if body.mass < inf}
