"""A case by its name: structure, what is hidden in which form, noise, nuisance and seed decide every bit of it."""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from math import inf
from typing import NamedTuple

import numpy as np

from ..fault import Fault
from ..recording import Recording
from .curves import Cubic, Curve, Stop, Straight, Sum
from .forms import FORMS, Answer, Hidden, hide
from .machine import Motion, SimulationError
from .sensors import LOAD_CELL, NUISANCES, Sensors, times
from .sizes import Base, Peaks
from .structures import STRUCTURES, G, Rng, Setup, draw

NOTHING = "nothing"
SPEEDS = (0.7, 1.0)
"""Of the nominal one: two recordings of a structure."""

ATTEMPTS = 12
COARSE = 10
"""Of RATE: every tenth instant is enough to see how large a difference is."""

SEEN = 25.0
"""Standard deviations of 1 g of noise that must be left of what the effect does to the recordings (root of the sum of
squares over both), once the model's stiffnesses have taken what they can. Half of a diagnosis's work is to find what
is less; this bound only says that it can be there to be found."""

LOADED = 0.15
"""Of the largest peak force: a target that carries less is not one that the test is about."""


class CaseError(Fault):
    """There is no such case, or it cannot be drawn."""


class Case(NamedTuple):
    structure: str
    form: str  # of FORMS, or NOTHING
    noise: float  # g
    nuisance: str
    seed: int

    @property
    def name(self) -> str:
        return f"{self.structure}/{self.form}/{self.noise:g}g/{self.nuisance}/{self.seed}"


def case_of(name: str) -> Case:
    """The case that a name means; raises CaseError where it is none."""
    try:
        structure, form, noise, nuisance, seed = name.split("/")
        case = Case(structure, form, float(noise.removesuffix("g")), nuisance, int(seed))
    except ValueError:
        case = None
    if (
        not case
        or case.structure not in STRUCTURES
        or case.nuisance not in NUISANCES
        or case.form not in (*FORMS, NOTHING)
    ):
        like = Case("side", "friction.lugre", 1.0, "clean", 1).name
        raise CaseError(f"a case's name is written like {like}, got {name!r}")
    return case


class Drawn(NamedTuple):
    """A case: what is given to a diagnosis, and what it should say."""

    model_text: str
    recordings: list[Recording]
    right: tuple[Answer, ...]
    gap: float
    seen: float  # standard deviations; 0 where nothing is hidden
    target: str


def drawn(case: Case) -> Drawn:
    """The same for the same case, bit for bit; raises CaseError where no structure of ATTEMPTS shows the effect."""
    for attempt in range(ATTEMPTS):
        rng = np.random.default_rng([case.seed, attempt])
        try:
            found = _attempt(case, rng)
        except SimulationError:
            continue
        if found:
            return found
    raise CaseError(f"{case.name}: not seen in {ATTEMPTS} structures")


def _attempt(case: Case, rng: Rng) -> Drawn | None:
    form = FORMS.get(case.form)
    setup = draw(
        case.structure, rng, form.straight if form else rng.random() < 0.4, bool(form and form.elastic),
        bool(form and form.lined),
    )  # fmt: skip
    setup = replace(setup, plain=setup.joints, masses={b.name: b.mass for b in setup.bodies if b.mass < inf})
    target, hidden, seen = "", Hidden(setup, (), {}), 0.0
    if form:
        target = str(rng.choice(form.targets[case.structure]))
        base = _base(setup, target, rng)
        if target in setup.joints and base.peak.f < LOADED * _largest(base):
            return None
        hidden = hide(case.form, base)
        if not hidden.setup.unmodelled:  # that changes the model, not the recording
            seen = _seen(setup, hidden)
            if seen < SEEN:
                return None
    told = hidden.setup
    if case.nuisance == "masses":
        off = {name: m * (1.0 + _either(rng) * rng.uniform(0.01, 0.02)) for name, m in (told.masses or {}).items()}
        told = replace(told, masses=off)
    sensors = Sensors(told, hidden.wrong, case.noise, case.nuisance)
    recordings = sensors.record([_run(told, sensors, speed) for speed in SPEEDS], case.seed, case.structure)
    return Drawn(told.model_text(), recordings, hidden.right, hidden.gap, seen, target)


def _either(rng: Rng) -> float:
    return 1.0 if rng.random() < 0.5 else -1.0


def _run(setup: Setup, sensors: Sensors, speed: float, every: int = 1) -> tuple[Motion, Motion]:
    """The motion, and what a channel that is late sees of it."""
    machine, when = setup.machine(speed), times(setup.until)[::every]
    motion = machine.run(when)
    late = sensors.late()
    return motion, machine.run(when - late) if late else motion


# --- how large it is, and whether it can be seen


def _base(setup: Setup, target: str, rng: Rng) -> Base:
    motion = setup.machine(1.0).run(times(setup.until)[::COARSE])
    names = [body.name for body in setup.bodies]

    @lru_cache
    def peaks(a: str, b: str) -> Peaks:
        if not b:
            i = names.index(a)
            return Peaks(0.0, 0.0, setup.body(a).mass * float(np.abs(motion.a[:, i]).max()))
        i, j = names.index(a), names.index(b)
        x, v = motion.x[:, i] - motion.x[:, j], motion.v[:, i] - motion.v[:, j]
        force = next((motion.forces[:, k] for k, o in enumerate(setup.joints.values()) if (o.a, o.b) == (a, b)), None)
        if force is None:
            return Peaks(float(x.max()), float(np.abs(v).max()), float(np.abs(motion.forces).max()))
        acts = np.abs(force) > 0.01 * np.abs(force).max()
        return Peaks(float(x.max()), float(np.abs(v[acts]).max()), float(force.max()))

    return Base(setup, target, peaks, rng)


def _largest(base: Base) -> float:
    return max(base.peaks(joint.a, joint.b).f for joint in base.setup.joints.values())


def _signals(setup: Setup, wrong, like: Setup) -> np.ndarray:
    """All that is compared, of both tests, in standard deviations of 1 g of noise at the full rate."""
    sensors, parts = Sensors(setup, wrong, 1.0, "clean"), []
    for speed in SPEEDS:
        true = sensors.true(*_run(setup, sensors, speed, COARSE))
        names = [f"{body}_a{like.axis}" for body in like.free]
        parts += [true[name] / G for name in names]
        if like.barrier:
            parts.append(true[f"{like.barrier}_f{like.axis}"] / LOAD_CELL)
    return np.concatenate(parts) * np.sqrt(COARSE)


def _seen(setup: Setup, hidden: Hidden) -> float:
    """What the effect changes, less what the model's stiffnesses could change to first order."""
    base = _signals(setup, {}, setup)
    changed = _signals(hidden.setup, hidden.wrong, setup) - base
    tangents = []
    for name, element in setup.elements.items():
        joint = setup.joints[name]
        for more in _directions(joint.curve, 0.3 if joint.one_way else 0.1, element.constant):
            bent = setup.with_joint(name, replace(joint, curve=Sum((joint.curve, more))))
            tangents.append(_signals(bent, {}, setup) - base)
    freedom = np.column_stack(tangents)
    taken, *_ = np.linalg.lstsq(freedom, changed, rcond=None)
    return float(np.linalg.norm(changed - freedom @ taken))


def _directions(curve: Curve, depth: float, constant: bool) -> Sequence[Curve]:
    """A hundredth of the stiffness more; where the model's curve is free, also late in the crush, and in its middle."""
    k = 0.01 * curve.force(depth) / depth
    return [Straight(k)] if constant else [Straight(k), Cubic(k / depth**2), Stop(0.4 * depth, k)]
