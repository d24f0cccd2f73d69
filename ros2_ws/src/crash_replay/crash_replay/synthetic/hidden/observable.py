"""Where an effect can be told at all: its admissible targets in a specimen, and whether it shows.

Left out, because no method could name them from what is recorded:

- effects on elements that hardly carry (under 15 % of the largest peak force, or under 10 mm of crush);
- `cubic_stiffness`, `bottoming_out`, `yielding`, `clearance` where the model leaves the element's curve free: such a
  curve contains them. They are hidden where the model says one constant stiffness, or a known one;
- `yielding` of an element that unloads along a line of its own, beside which it would pull;
- `plastic_unloading` of an element that has not come down to half of its peak force when the record ends;
- the car of `single` made heavier, or its barrier's gain wrong: M a = -F and F are all that is measured, so both scale
  F alike, and its curve is free;
- with a measured crush (`impactor`) a scale of the only equation M a = F(X, V), F free: `added_mass`, `channel_gain`;
  a constant in it: `constant_force` is `channel_offset`, and so is `guide_friction` while it goes one way; a lag in it:
  `channel_delay` is a damper less; `initial_velocity` is not used;
- `guide_friction` of a body that does not come back: it is a constant force then, from which it must differ by SHOWS;
- `load_path` in a structure whose bodies are all joined already;
- a `clearance` or other law with which the element hardly carries any more: no stiffness at all then does as well;
- whatever moves the recorded accelerations and forces by less than SHOWS in all, beside the other effects hidden;
- a driven channel's error that moves what the channel drives by less than REMAINS, when the laws that the model leaves
  free have taken in what they can: the channel itself is no prediction, and a soft free curve takes in nearly all;
- what is outside the vocabulary in name only: by less than SHOWS_OUTSIDE from the nearest effect inside, such as a mass
  that has grown before the body is pushed. It is more than SHOWS because several effects together come nearer than one.
"""

from collections.abc import Iterator
from functools import partial

import numpy as np

from ...gravity import G
from ..curves import Curve
from ..integrate import simulate
from ..scenario import signals_of
from ..sensors import Sensor
from ..system import Motion
from .outside import OUTSIDE, nearest_inside
from .specimen import COARSE_RATE, COARSE_STEP, SPEEDS, Peaks, Specimen, carrier_of, peaks_of

CARRIES, MOVES, UNLOADS = 0.15, 0.010, 0.5
"""Share of the largest peak force; m; share of the peak force that is gone at the end."""

SHOWS = 20.0
"""Standard deviations: root of the sum over both recordings at 10 kHz of ((with - without) / sensor noise)^2, with the
effect at its nominal size and 1 g of noise. The structure's own free parameters absorb a part of it."""

REMAINS = 0.75 * SHOWS
"""The same, of what no free law absorbs. At 2 g that is 1/2 (REMAINS / 2)^2 = 28 nats to find an error by, of which the
unknown zero offsets and drift of the driven channels themselves take another half."""

FOLDS = 16
"""Stretches of a free curve, over the crush met, that may each push a little more or less."""

PUSH = 0.001
"""Of an element's peak force: as little as the integration resolves, for the answer is not linear for long."""

FORWARD = 10.0
"""m/s: any friction is whole there."""

ON_ELEMENTS = (
    "viscous_damping", "quadratic_damping", "coulomb_friction", "hysteresis", "maxwell_element", "gas_cushion",
    "rate_hardening", "cubic_stiffness", "bottoming_out", "yielding", "clearance", "plastic_unloading",
)  # fmt: skip

SHOWS_OUTSIDE = 3.0 * SHOWS

NOISE = {"acceleration": 1.0 * G, "force": 3000.0}

NOT_TOLD = {
    "single": {("added_mass", "car"), ("channel_gain", "barrier_fx")},
    "impactor": {
        ("added_mass", "impactor"), ("channel_gain", "impactor_ax"), ("constant_force", "impactor"),
        ("channel_offset", "impactor_ax"), ("channel_delay", "impactor_ax"), ("guide_friction", "impactor"),
        ("initial_velocity", "impactor"),
    },
}  # fmt: skip


def nameable(specimen: Specimen, effect: str) -> list[str]:
    """What the effect could act on in a structure, whatever is drawn; empty where nothing."""
    channels = {q: [s.channel.name for s in specimen.scenario.sensors if s.channel.quantity == q] for q in NOISE}
    match effect:
        case _ if effect in ON_ELEMENTS:
            found = [e.name for e in specimen.scenario.system.elements]
        case "load_path":
            found = ["-".join(pair) for pair in specimen.pairs]
        case "unmodelled_body":
            found = [f"extra_a{specimen.scenario.sensors[0].channel.axis}"]
        case "channel_delay" | "channel_gain":
            found = channels["acceleration"] + channels["force"]
        case "force_offset":
            found = channels["force"]
        case "channel_offset":
            found = channels["acceleration"]
        case "initial_velocity":
            found = [b.name for b in specimen.scenario.system.bodies if b.mass and b.velocity][:1]
        case _:
            found = [b.name for b in specimen.scenario.system.bodies if b.mass]
    return [target for target in found if (effect, target) not in NOT_TOLD.get(specimen.name, ())]


def targets(specimen: Specimen, peaks: Peaks, effect: str) -> list[str]:
    """Where the effect can be hidden in the specimen; empty where nowhere."""
    if effect not in ON_ELEMENTS:
        return nameable(specimen, effect)
    strongest = max(peaks.force.values())
    carrying = [e for e in peaks.force if peaks.force[e] >= CARRIES * strongest and peaks.travel[e] >= MOVES]
    pressed = [e for e in carrying if peaks.crush[e] >= MOVES]
    match effect:
        case "viscous_damping" | "quadratic_damping" | "coulomb_friction" | "hysteresis" | "maxwell_element":
            return carrying
        case "rate_hardening" | "gas_cushion":
            return pressed
        case "plastic_unloading":
            return [e for e in pressed if peaks.drop[e] >= UNLOADS]
    if effect == "yielding":  # what unloads along a line has its own
        pressed = [e for e in pressed if not carrier_of(specimen.element(e)).unloading]
    known = specimen.model["elements"]  # not one that is hidden itself
    return [e for e in pressed if e in known and specimen.told(e) != "curve"]


def shows(bare: Specimen, effect: str, target: str, with_it: Specimen) -> bool:
    """Whether an effect of nominal size, hidden in `bare`, can be told from what is recorded."""
    if effect in ON_ELEMENTS and target not in targets(with_it, peaks_of(with_it), effect):
        return False
    if effect in OUTSIDE and distance(nearest_inside(with_it, effect, target), with_it) < SHOWS_OUTSIDE:
        return False
    if effect == "guide_friction" and distance(_pushed_back(bare, target, with_it), with_it) < SHOWS:
        return False
    if (sensor := _driving(with_it, target)) is not None:
        taken = _driven_as_recorded(bare, sensor)
        return all(apart(bare, taken, besides=target) >= REMAINS for apart in (distance, _unabsorbed))
    return distance(bare, with_it) >= SHOWS


def _pushed_back(bare: Specimen, target: str, guided: Specimen) -> Specimen:
    """With a constant force as large as the friction of a body that moves forward."""
    friction = guided.element("guide").force(0.0, FORWARD, 0.0)
    return bare.with_body(target, push=lambda time: np.full(len(time), -friction))


def distance(specimen: Specimen, other: Specimen, besides: str = "") -> float:
    """Standard deviations between what the sensors of two specimens record, without noise; see SHOWS.

    besides: a channel that is left out.
    """
    total = 0.0
    for ours, theirs in zip(_recorded(specimen), _recorded(other)):
        total += sum(np.sum((ours[c] - theirs[c]) ** 2) for c in (ours.keys() & theirs.keys()) - {besides})
    return float(np.sqrt(total * specimen.scenario.rate / COARSE_RATE))


def _unabsorbed(specimen: Specimen, other: Specimen, besides: str) -> float:
    """The distance that is left when the specimen's free laws have come as near to the other as they can, to first
    order."""
    names = [s.channel.name for s in specimen.scenario.sensors if s.channel.quantity in NOISE]
    seen = [name for name in names if name != besides]

    def signal(of: Specimen) -> np.ndarray:
        return np.concatenate([run[name] for run in _recorded(of) for name in seen])

    bare = signal(specimen)
    apart = signal(other) - bare
    bends = np.stack([signal(bent) - bare for bent in _bent(specimen)] or [np.zeros_like(bare)], axis=1)
    left = apart - bends @ np.linalg.lstsq(bends, apart, rcond=None)[0]
    return float(np.linalg.norm(left) * np.sqrt(specimen.scenario.rate / COARSE_RATE))


def _bent(specimen: Specimen) -> Iterator[Specimen]:
    """The specimen with a little more force in one stretch of a law that the model leaves free."""
    system, duration = specimen.scenario.system, specimen.scenario.duration
    time = np.arange(0.0, duration, 1.0 / COARSE_RATE)
    runs = [simulate(system.at_speed(speed), time, COARSE_STEP) for speed in SPEEDS]
    for k, element in enumerate(system.elements):
        free = specimen.told(element.name) if element.name in specimen.model["elements"] else "known"
        if free == "known":
            continue
        carries = np.concatenate([run.crush[run.force[:, k] != 0.0, k] for run in runs] + [[0.0]])
        peak = max(float(np.abs(run.force[:, k]).max()) for run in runs)
        low, high = min(float(carries.min()), 0.0), max(float(carries.max()), 1e-3)
        x = np.linspace(low, high, FOLDS + 1)
        shapes = [x / np.abs(x).max()] if free == "constant" else list(np.eye(FOLDS + 1))
        for shape in shapes:
            push = Curve(x, PUSH * peak * shape)
            laws = (*carrier_of(element).parallel, partial(_of_crush, push))
            yield specimen.with_law(element.name, parallel=laws)


def _of_crush(push: Curve, crush: float, rate: float) -> float:
    return push(crush)


def _driving(specimen: Specimen, channel: str) -> Sensor | None:
    """The sensor that has the channel, where its body is driven."""
    sensors = [s for s in specimen.scenario.sensors if s.channel.name == channel]
    return next((s for s in sensors if s.of in specimen.model["bodies"] and specimen.body(s.of).motion), None)


def _driven_as_recorded(bare: Specimen, sensor: Sensor) -> Specimen:
    """The specimen as a model would have it that takes a wrong channel for its body's motion."""
    from scipy.integrate import cumulative_trapezoid  # late: it takes longer to import than all the rest

    motion, step = bare.body(sensor.of).motion, 1.0 / COARSE_RATE
    time = np.arange(0.0, bare.scenario.duration + step, step)
    seen = np.where(time >= sensor.delay, motion.acceleration(time - sensor.delay), 0.0)
    seen = sensor.distortion(time, seen) if sensor.distortion else seen
    velocity = motion.velocity[0] + cumulative_trapezoid(seen, time, initial=0.0)
    return bare.with_body(sensor.of, motion=Motion(time, velocity))


def _recorded(specimen: Specimen) -> list[dict[str, np.ndarray]]:
    """At each speed, channel -> (n,) signal in standard deviations of its noise."""
    scenario = specimen.scenario
    time = np.arange(0.0, scenario.duration, 1.0 / COARSE_RATE)
    sensors = [s for s in scenario.sensors if s.channel.quantity in NOISE]
    runs = []
    for speed in SPEEDS:
        signals = signals_of(scenario.system.at_speed(speed), sensors, time, COARSE_STEP)
        runs.append({s.channel.name: x / NOISE[s.channel.quantity] for s, x in zip(sensors, signals)})
    return runs
