"""Four crash tests, drawn from a seed: bodies, elements, and the model file that a user would write for them.

    wall   a car against a rigid barrier, which measures its force
    cab    cab and engine against that barrier
    side   rib and spine of a dummy, struck by a door that moves as measured
    sled   an impactor that strikes a block, held on a sled that is free to go

Sizes are such that the largest acceleration is 20 to 60 g: at one nominal speed, where sensors have 0.5 to 2 g of
noise.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import inf, pi, sin

import numpy as np

from .branches import Dashpot
from .curves import Bilinear, Curve, Plateau, Progressive, Straight
from .joint import Joint
from .machine import Body, Machine

G = 9.80665
Rng = np.random.Generator


@dataclass(frozen=True)
class Element:
    """What the model says of a joint."""

    constant: bool  # one stiffness; else its force is a free curve over crush
    damping: float = 0.0  # known, N s/m


@dataclass(frozen=True)
class Setup:
    """One structure as it is, and what its model says."""

    name: str
    bodies: tuple[Body, ...]  # speeds and driven motions of the nominal test
    joints: Mapping[str, Joint]  # as they are
    elements: Mapping[str, Element]  # as the model has them, by the joints' names
    until: float  # s
    axis: str = "x"
    barrier: str = ""  # a fixed body whose force is measured
    masses: Mapping[str, float] | None = None  # as the model has them, where not as they are
    unmodelled: tuple[str, ...] = ()  # bodies that the model has not got, their channel recorded
    hidden_bodies: tuple[str, ...] = ()  # bodies that nobody sees
    plain: Mapping[str, Joint] | None = None  # the joints as the model believes them, where not as they are
    stated: float = 1.0  # speeds that the test states, times the real ones

    def body(self, name: str) -> Body:
        return next(body for body in self.bodies if body.name == name)

    def with_body(self, name: str, **changed) -> "Setup":
        return replace(self, bodies=tuple(replace(b, **changed) if b.name == name else b for b in self.bodies))

    def with_joint(self, name: str, joint: Joint) -> "Setup":
        return replace(self, joints={**self.joints, name: joint})

    @property
    def free(self) -> tuple[str, ...]:
        """Bodies whose balance is fitted."""
        unseen = (*self.unmodelled, *self.hidden_bodies)
        return tuple(b.name for b in self.bodies if b.mass < inf and b.name not in unseen)

    def faster(self, speed: float) -> tuple[Body, ...]:
        """Its bodies at another speed: every initial velocity and driven motion times it."""
        return tuple(_faster(body, speed) for body in self.bodies)

    def machine(self, speed: float) -> Machine:
        return Machine(self.faster(speed), self.joints)

    def model_text(self) -> str:
        lines = [f"name: {self.name}", "bodies:"]
        for body in self.bodies:
            if body.name in (*self.unmodelled, *self.hidden_bodies):
                continue
            if body.motion:
                what = f"motion: {body.name}_a{self.axis}"
            elif body.mass == inf:
                what = "fixed: true" + (f", force: {body.name}_f{self.axis}" if body.name == self.barrier else "")
            else:
                mass = (self.masses or {}).get(body.name, body.mass)
                what = f"mass: {mass:.4f}, acceleration: {body.name}_a{self.axis}"
            lines.append(f"  {body.name}: {{{what}}}")
        lines.append("elements:")
        for name, element in self.elements.items():
            joint = (self.plain or self.joints)[name]
            shape = "constant" if element.constant else "curve"
            lines += [
                f"  {name}:",
                f"    between: [{joint.a}, {joint.b}]",
                f"    stiffness: {{estimate: true, shape: {shape}, initial: {_rough(joint.curve):.0f}, min: 0.0}}",
                f"    damping: {element.damping:.2f}",
                *(["    tension: none"] if joint.one_way else []),
                *([f"    unloading: {joint.unload:.1f}"] if joint.unload else []),
            ]
        return "\n".join(lines) + "\n"


def _faster(body: Body, speed: float) -> Body:
    motion = body.motion
    return replace(body, v=body.v * speed, motion=(lambda t: speed * motion(t)) if motion else None)


def _rough(curve: Curve) -> float:
    """What an engineer would begin with: two digits of the stiffness in the first 5 cm, 20 % off."""
    return float(f"{0.8 * curve.force(0.05) / 0.05:.1e}")


def draw(name: str, rng: Rng, straight: bool, elastic: bool, lined: bool) -> Setup:
    """`straight`: all elements of one stiffness each; `elastic`: none has a line of its own, or all that may
    (`lined`)."""
    return STRUCTURES[name](rng, straight, lined or (not elastic and rng.random() < 0.6))


def _curve(rng: Rng, straight: bool, k: float, depth: float) -> Curve:
    """About k over a crush of `depth`."""
    kind = 0 if straight else int(rng.integers(4))
    if kind == 1:
        return Bilinear(1.4 * k, depth * rng.uniform(0.25, 0.45), k * rng.uniform(0.5, 0.8))
    if kind == 2:
        return Progressive(0.7 * k, rng.uniform(0.4, 0.9), depth)
    if kind == 3:
        return Plateau(2.0 * k, k * depth * rng.uniform(0.5, 0.8), 0.4 * k)
    return Straight(k)


def _wall(rng: Rng, straight: bool, lined: bool) -> Setup:
    m, v, peak = rng.uniform(900.0, 1700.0), rng.uniform(13.0, 16.0), rng.uniform(25.0, 38.0) * G
    k = m * (peak / v) ** 2
    curve = _curve(rng, straight, k, v * v / peak)
    bodies = (Body("car", m, v), Body("barrier", inf))
    joint = Joint("car", "barrier", curve, unload=k * rng.uniform(4.0, 9.0) if lined else None)
    joints = {"car_barrier": joint}
    return Setup(
        "wall", bodies, joints, {"car_barrier": Element(straight)}, until=2.0 * 0.5 * pi * v / peak, barrier="barrier"
    )


def _cab(rng: Rng, straight: bool, lined: bool) -> Setup:
    cab, engine = rng.uniform(900.0, 1300.0), rng.uniform(250.0, 420.0)
    v, peak = rng.uniform(13.0, 16.0), rng.uniform(25.0, 36.0) * G
    k, depth = (cab + engine) * (peak / v) ** 2, v * v / peak
    bodies = (Body("cab", cab, v), Body("engine", engine, v), Body("barrier", inf))
    k1, k2, k3 = k * rng.uniform(0.35, 0.55), k * rng.uniform(0.5, 0.8), k * rng.uniform(1.0, 1.8)
    slope = rng.uniform(4.0, 9.0)
    joints = {
        "cab_barrier": Joint("cab", "barrier", _curve(rng, straight, k1, depth), unload=slope * k1 if lined else None),
        "engine_barrier": Joint(
            "engine", "barrier", _curve(rng, straight, k2, 0.6 * depth), unload=slope * k2 if lined else None
        ),
        "cab_engine": Joint("cab", "engine", Straight(k3)),
    }
    elements = {name: Element(straight or name == "cab_engine") for name in joints}
    return Setup("cab", bodies, joints, elements, until=1.9 * 0.5 * pi * v / peak, barrier="barrier")


def _side(rng: Rng, straight: bool, lined: bool) -> Setup:
    rib, spine = rng.uniform(12.0, 20.0), rng.uniform(20.0, 32.0)
    top, rise, late = rng.uniform(9.0, 11.5), rng.uniform(0.014, 0.022), rng.uniform(0.25, 0.4)
    fall = 0.075

    def door(t: float) -> float:
        """Two half sines: struck to `top` m/s within `rise`, then held back by the rest of the car."""
        if t < rise:
            return top * pi / (2.0 * rise) * sin(pi * t / rise)
        return -late * top * pi / (2.0 * fall) * sin(pi * (t - rise) / fall) if t < rise + fall else 0.0

    k1, k2 = rng.uniform(4.5e4, 8.0e4), rng.uniform(4.0e4, 8.0e4)
    c2 = rng.uniform(100.0, 300.0)
    bodies = (Body("rib", rib), Body("spine", spine), Body("door", inf, motion=door))
    joints = {
        "door_rib": Joint(
            "door", "rib", _curve(rng, straight, k1, 0.1), unload=k1 * rng.uniform(3.0, 6.0) if lined else None
        ),
        "rib_spine": _damped(Joint("rib", "spine", Straight(k2), one_way=False), c2),
    }
    elements = {"door_rib": Element(straight), "rib_spine": Element(True, c2)}
    return Setup("side", bodies, joints, elements, until=0.1, axis="y")


def _sled(rng: Rng, straight: bool, lined: bool) -> Setup:
    impactor, block, sled = rng.uniform(70.0, 120.0), rng.uniform(30.0, 50.0), rng.uniform(80.0, 160.0)
    v = rng.uniform(8.5, 11.0)
    k1, k2, c2 = rng.uniform(1.2e5, 2.2e5), rng.uniform(1.2e5, 2.4e5), rng.uniform(200.0, 600.0)
    bodies = (Body("impactor", impactor, v), Body("block", block), Body("sled", sled))
    joints = {
        "impactor_block": Joint(
            "impactor", "block", _curve(rng, straight, k1, 0.15), unload=k1 * rng.uniform(3.0, 6.0) if lined else None
        ),
        "block_sled": _damped(Joint("block", "sled", Straight(k2), one_way=False), c2),
    }
    elements = {"impactor_block": Element(straight), "block_sled": Element(True, c2)}
    return Setup("sled", bodies, joints, elements, until=0.12)


def _damped(joint: Joint, c: float) -> Joint:
    return joint.with_branch(Dashpot(c))


STRUCTURES = {"wall": _wall, "cab": _cab, "side": _side, "sled": _sled}
