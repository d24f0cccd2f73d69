"""The effects of the vocabulary, hidden in a specimen.

A function gets the specimen, its peaks without the effect, the target, a share and a stream of random numbers,
and gives the specimen with the effect and what was hidden. The share is the effect's size: about what it
makes of the target's peak force, 0.12 to 0.35 for a nominal one.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...gravity import G
from ..forces import Slip
from ..sensors import accelerometer
from ..system import Body, Element
from . import laws
from .curves import steepest, straight
from .specimen import Peaks, Specimen, carrier_of

STOPPED = 60.0
"""rad/s, of an unmodelled body against its stop: some 60 g at 10 m/s, as an engine at the barrier."""


@dataclass(frozen=True)
class Hidden:
    """What was hidden, in the vocabulary's terms."""

    effect: str
    target: str
    coefficient: float  # SI
    unit: str
    shape: Mapping[str, float] = field(default_factory=dict)

    def described(self) -> dict[str, Any]:
        """For the truth file."""
        return vars(self) | {"shape": dict(self.shape)}


Hide = Callable[[Specimen, Peaks, str, float, np.random.Generator], tuple[Specimen, Hidden]]


def viscous_damping(specimen, peaks, target, share, rng):
    c = share * peaks.force[target] / peaks.rate[target]
    known = specimen.element(target).spring.damping
    return specimen.with_law(target, damping=known + c), Hidden("viscous_damping", target, c, "N*s/m")


def quadratic_damping(specimen, peaks, target, share, rng):
    c = share * peaks.force[target] / peaks.rate[target] ** 2
    return _parallel(specimen, target, laws.quadratic_damping(c)), Hidden("quadratic_damping", target, c, "N*s^2/m^2")


def coulomb_friction(specimen, peaks, target, share, rng):
    c, speed = 0.7 * share * peaks.force[target], float(rng.choice([0.05, 0.1, 0.2]))
    hidden = Hidden("coulomb_friction", target, c, "N", {"speed": speed})
    return _parallel(specimen, target, laws.coulomb_friction(c, speed)), hidden


def hysteresis(specimen, peaks, target, share, rng):
    """As Bouc and Wen have it, or two dry sliders behind springs."""
    c = 0.7 * share * peaks.force[target]
    yields = float(rng.uniform(0.05, 0.2)) * max(peaks.crush[target], 0.3 * peaks.travel[target])
    if rng.random() < 0.5:
        exponent = float(rng.choice([1.0, 2.0, 4.0]))
        flow, shape = laws.bouc_wen(yields, exponent), {"yield_crush": yields, "exponent": exponent}
    else:
        flow, shape = laws.two_sliders(yields, 0.5), {"yield_crush": yields}
    slip = Slip(c, flow, largest=1.0, both_ways=specimen.element(target).spring.tension)
    elements = [replace(e, slip=slip) if e.name == target else e for e in specimen.scenario.system.elements]
    return specimen.with_parts(elements=elements), Hidden("hysteresis", target, c, "N", shape)


def maxwell_element(specimen, peaks, target, share, rng):
    """A spring behind a damper, which relaxes within a tenth to a half of the time that the crush takes."""
    relaxes = float(rng.uniform(0.1, 0.5)) * max(peaks.crush[target], 0.3 * peaks.travel[target]) / peaks.rate[target]
    c = 1.4 * share * peaks.force[target] / (peaks.rate[target] * relaxes)
    slip = Slip(c, laws.maxwell(relaxes), both_ways=specimen.element(target).spring.tension)
    elements = [replace(e, slip=slip) if e.name == target else e for e in specimen.scenario.system.elements]
    hidden = Hidden("maxwell_element", target, c, "N/m", {"relaxation_time": relaxes})
    return specimen.with_parts(elements=elements), hidden


def gas_cushion(specimen, peaks, target, share, rng):
    """As long as 1.3 to 2 of the largest crush; a share of its gas that matters leaves while it is pressed."""
    pressed = max(peaks.crush[target], 0.3 * peaks.travel[target])
    length, leak = float(rng.uniform(1.3, 2.0)) * pressed, float(rng.uniform(0.2, 0.8)) * peaks.rate[target] / pressed
    c = share * peaks.force[target] * length / pressed
    slip = Slip(c, laws.vented_gas(length, leak), both_ways=specimen.element(target).spring.tension)
    elements = [replace(e, slip=slip) if e.name == target else e for e in specimen.scenario.system.elements]
    hidden = Hidden("gas_cushion", target, c, "N", {"length": length, "leak": leak})
    return specimen.with_parts(elements=elements), hidden


def rate_hardening(specimen, peaks, target, share, rng):
    """Cowper-Symonds: D is such that the force is `share` higher at the largest rate."""
    exponent = float(rng.choice([1.0, 2.0, 4.0, 5.0]))
    doubling = peaks.rate[target] / share**exponent
    hidden = Hidden("rate_hardening", target, doubling, "m/s", {"exponent": exponent})
    return specimen.with_law(target, hardening=(doubling, exponent)), hidden


def cubic_stiffness(specimen, peaks, target, share, rng):
    c = 1.5 * share * peaks.force[target] / peaks.crush[target] ** 3
    return _parallel(specimen, target, laws.cubic_stiffness(c)), Hidden("cubic_stiffness", target, c, "N/m^3")


def bottoming_out(specimen, peaks, target, share, rng):
    """At half to three quarters of the crush; four times `share` as stiff as the element."""
    stop = float(rng.uniform(0.5, 0.75) * peaks.crush[target])
    c = 4.0 * share * peaks.force[target] / peaks.crush[target]
    hidden = Hidden("bottoming_out", target, c, "N/m", {"stop": stop})
    return _parallel(specimen, target, laws.bottoming_out(c, stop)), hidden


def yielding(specimen, peaks, target, share, rng):
    """At a third to two thirds of the crush; a third to nine tenths of its stiffness is lost for a nominal share."""
    at = float(rng.uniform(0.33, 0.66) * peaks.crush[target])
    c = 2.6 * share * peaks.force[target] / peaks.crush[target]
    hidden = Hidden("yielding", target, c, "N/m", {"yield_crush": at})
    return _parallel(specimen, target, laws.yielding(c, at)), hidden


def clearance(specimen, peaks, target, share, rng):
    gap = 0.5 * share * peaks.crush[target]
    return specimen.with_law(target, gap=gap, tension=False), Hidden("clearance", target, gap, "m")


def plastic_unloading(specimen, peaks, target, share, rng):
    """A slope that the model has not got, or another one than it has: further from it the larger the share.

    Never below the steepest loading slope: such a line would leave a force at no crush.
    """
    law = specimen.element(target).spring
    steep = 1.05 * steepest(law.curve, peaks.crush[target])
    if law.unloading is None:
        slope = steep * (1.0 + 0.2 / share * rng.uniform(0.5, 1.0))
    else:
        slope = max(law.unloading * (1.0 + 4.0 * share) ** float(rng.choice([-1.0, 1.0])), steep)
    return specimen.with_law(target, unloading=slope, tension=False), Hidden("plastic_unloading", target, slope, "N/m")


def load_path(specimen, peaks, target, share, rng):
    """A linear spring between two bodies, both ways, counted from their distance at time zero."""
    a, b = target.split("-")
    distance = specimen.body(a).displacement - specimen.body(b).displacement
    c = 2.0 * share * float(np.median([peaks.force[e] / peaks.crush[e] for e in peaks.force]))
    element = Element("load_path", (a, b), lambda crush, rate, peak: c * (crush - distance))
    return _with(specimen, elements=[element]), Hidden("load_path", target, c, "N/m")


def added_mass(specimen, peaks, target, share, rng):
    mass = specimen.body(target).mass
    return specimen.with_body(target, mass=mass * (1.0 + share)), Hidden("added_mass", target, mass * share, "kg")


def unmodelled_body(specimen, peaks, target, share, rng):
    """A body on a soft, lightly damped mount; where the structure has a stop for it, it runs into that."""
    host = specimen.body(specimen.host)
    mass, pulsation = host.mass * share, 2.0 * np.pi * rng.uniform(12.0, 30.0)
    body = Body(target.rpartition("_a")[0], mass, host.velocity, host.displacement)
    mount = laws.Carrier(straight(mass * pulsation**2), damping=0.2 * mass * pulsation)
    elements = [Element("mount", (host.name, body.name), mount)]
    if specimen.stop:
        stop, distance = specimen.stop
        block = laws.Carrier(straight(mass * STOPPED**2), tension=False, gap=distance)
        elements.append(Element("stop", (body.name, stop), block))
    sensors = [accelerometer(target, body.name)]
    return _with(specimen, [body], elements, sensors), Hidden("unmodelled_body", target, mass, "kg")


def constant_force(specimen, peaks, target, share, rng):
    force = 0.4 * share * peaks.acceleration[target] * specimen.body(target).mass * float(rng.choice([-1.0, 1.0]))
    pushed = specimen.with_body(target, push=lambda time: np.full(len(time), force))
    return pushed, Hidden("constant_force", target, force, "N")


def guide_friction(specimen, peaks, target, share, rng):
    """Dry friction of a body on something that rests."""
    c = 0.4 * share * peaks.acceleration[target] * specimen.body(target).mass
    speed = float(rng.choice([0.05, 0.1, 0.2]))
    friction = laws.coulomb_friction(c, speed)
    guide = Element("guide", (target, "rail"), lambda crush, rate, peak: friction(crush, rate))
    guided = _with(specimen, [Body("rail")], [guide])
    return guided, Hidden("guide_friction", target, c, "N", {"speed": speed})


def initial_velocity(specimen, peaks, target, share, rng):
    """All is faster or slower than the test says, by 2 to 6 % for a nominal share."""
    error = 0.17 * share * float(rng.choice([-1.0, 1.0]))
    scenario = replace(specimen.scenario.at_speed(1.0 + error), stated=1.0 / (1.0 + error))
    return replace(specimen, scenario=scenario), Hidden("initial_velocity", target, error, "")


def channel_delay(specimen, peaks, target, share, rng):
    """0.3 to 0.8 ms for a nominal share."""
    delay = 2.3e-3 * share
    return specimen.with_sensor(target, delay=delay), Hidden("channel_delay", target, delay, "s")


def channel_gain(specimen, peaks, target, share, rng):
    """3 to 9 % for a nominal share."""
    gain = 0.26 * share * float(rng.choice([-1.0, 1.0]))
    hidden = Hidden("channel_gain", target, gain, "")
    return _distorted(specimen, target, lambda time, signal: (1.0 + gain) * signal), hidden


def channel_offset(specimen, peaks, target, share, rng):
    """1.6 to 4.6 g for a nominal share."""
    offset = 13.0 * G * share * float(rng.choice([-1.0, 1.0]))
    hidden = Hidden("channel_offset", target, offset, "m/s^2")
    return _distorted(specimen, target, lambda time, signal: signal + offset), hidden


def force_offset(specimen, peaks, target, share, rng):
    """2 to 7 % of the largest force for a nominal share."""
    offset = 0.2 * share * max(peaks.force.values()) * float(rng.choice([-1.0, 1.0]))
    hidden = Hidden("force_offset", target, offset, "N")
    return _distorted(specimen, target, lambda time, signal: signal + offset), hidden


VOCABULARY: Mapping[str, Hide] = {
    hide.__name__: hide
    for hide in (
        viscous_damping, quadratic_damping, coulomb_friction, hysteresis, maxwell_element, gas_cushion,
        rate_hardening, cubic_stiffness, clearance, bottoming_out, yielding, plastic_unloading, load_path, added_mass,
        unmodelled_body, constant_force, guide_friction, initial_velocity, channel_delay, channel_gain, channel_offset,
        force_offset,
    )
}  # fmt: skip


def _parallel(specimen: Specimen, target: str, law: laws.Parallel) -> Specimen:
    return specimen.with_law(target, parallel=(*carrier_of(specimen.element(target)).parallel, law))


def _distorted(specimen: Specimen, channel: str, distortion) -> Specimen:
    return specimen.with_sensor(channel, distortion=distortion)


def _with(specimen: Specimen, bodies=(), elements=(), sensors=()) -> Specimen:
    old = specimen.scenario
    system = replace(old.system, bodies=(*old.system.bodies, *bodies), elements=(*old.system.elements, *elements))
    return replace(specimen, scenario=replace(old, system=system, sensors=(*old.sensors, *sensors)))
