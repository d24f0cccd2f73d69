"""Other people's systems for `outside`: free bodies that a measured force pushes; one of them carries no sensor."""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.io import loadmat

from crash_replay.gravity import G
from crash_replay.recording import Channel, Recording, Test

from ..core.diagnosis import EFFECT_MISSING, Diagnosis, predict
from ..core.structure import Body, Coefficient, Element, Structure


class Case(NamedTuple):
    """One diagnosis, and what is true."""

    name: str
    recordings: Callable[[], list[Recording]]
    model: Structure | str  # or a ready one's name
    truth: str
    right: Callable[[Diagnosis], bool]
    besides: Callable[[Diagnosis], str] = lambda found: ""  # what else is told of it


DAMPER = Coefficient(1e-3, estimated=True, min=0.0)
AXIS = Structure(
    "axis",
    (Body("axis", mass=95.1, applied="motor_fx", displacement="axis_x"), Body("frame", fixed=True)),
    (Element("guide", ("axis", "frame"), Coefficient(0.0), DAMPER),),
)
FRICTION, WITHIN_OF_FRICTION = 20.39, 0.05
"""N, of the axis (Janot, Gautier, Brunot 2019), and the share of it that counts as right."""

OSCILLATOR = Structure(
    "oscillator",
    (Body("mass", mass=5.377e-6, applied="drive_fx", displacement="mass_x"), Body("ground", fixed=True)),
    (Element("spring", ("mass", "ground"), Coefficient(1.0, estimated=True, shape="constant"), DAMPER),),
)
"""An electronic circuit: volts stand for N and m. Its mass is that of the frequency response of samples 2000 to 10 192,
where it moves little."""
SAMPLING, TRAINED, TESTED = 610.35, slice(52_000, 60_192), slice(118_000, 126_192)
"""Hz; samples of two bursts of the multisine: one that is diagnosed, and one that what was found is simulated on."""
RUNG_OUT = 0.2
"""s at the beginning of a burst that are not counted: what it starts with, which nobody measured, has rung out then."""
LARGEST_ERROR = 1.1e-3
"""V, of that simulation: with y^2 and y^3 the benchmark's own authors reach 1.05 mV."""

NOSE, BODY = 0.0673, 0.5228  # kg
IMPACTOR = Structure(
    "impactor",
    (Body("nose", mass=NOSE, applied="water_fx"), Body("body", mass=BODY, acceleration=("body_ax",))),
    (Element("mount", ("nose", "body"), Coefficient(0.0), DAMPER),),
)
"""Two bodies that fall on water. The nose has no sensor, and the force on it is that on the same bodies without a
spring between them, (NOSE + BODY) a, mean of six repeats."""
MOUNTS, WITHIN_OF_SPRING = {"SF60100": 8160.0, "SS60100": 1740.0}, 0.1
"""N/m of the spring by file (TwoBodyConeImpactData, Boom et al. 2025), and the share of it that counts as right. Least
squares of the same two equations with a damper finds 5300 and 1020 N/m, with the nose's mass free 5580 and 1300."""
FELL, UNTIL = -0.05, 0.06
"""s about the impact that are taken: after them the impactor is under water."""


def other_systems(folder: Path) -> Iterator:
    """Of what the folder has."""
    oscillator = folder / "silverbox" / "SNLS80mV.csv"
    for file, besides in (("DATA_EMPS.mat", ""), ("DATA_EMPS_PULSES.mat", " and by pulses")):
        if (axis := folder / "emps" / file).exists():
            truth = f"dry friction of {FRICTION} N, then a constant force"
            read = partial(_axis, axis)
            yield Case(f"EMPS, an axis pushed by a motor{besides}, 24.8 s", read, AXIS, truth, _is_friction)
    if oscillator.exists():
        tested = _oscillator(oscillator, TESTED)
        yield Case(
            "Silverbox, an oscillator, 8192 samples", lambda: [_oscillator(oscillator, TRAINED)], OSCILLATOR,
            f"a cubic stiffness; free run of another burst within {1e3 * LARGEST_ERROR:g} mV",
            lambda found: _is_cubic(found, tested), lambda found: f"{1e3 * free_run_error(found, tested):.2g} mV",
        )  # fmt: skip
    rigid = folder / "cone" / "SR60100.mat"
    for name, spring in MOUNTS.items():
        sprung = rigid.with_name(f"{name}.mat")
        for repeats in ((1,), (1, 2)) if rigid.exists() and sprung.exists() else ():
            yield Case(
                f"two bodies dropped on water, {name}, " + " and ".join(map(str, repeats)),
                partial(_drops, rigid, sprung, repeats), IMPACTOR,
                f"a spring of {spring:g} N/m", partial(_is_spring, spring=spring),
            )  # fmt: skip


def _axis(path: Path) -> list[Recording]:
    data = loadmat(path)
    time = data["t"].ravel() - data["t"].ravel()[0]
    force = data["gtau"].item() * data["vir"].ravel()
    x = Channel("axis_x", "displacement"), data["qm"].ravel()
    return [_recording("emps", time, x, (Channel("motor_fx", "force"), force))]


def _oscillator(path: Path, samples: slice) -> Recording:
    drive, shown = np.genfromtxt(path, delimiter=",", skip_header=1, usecols=(0, 1))[samples].T
    return _recording(
        "silverbox", np.arange(len(shown)) / SAMPLING,
        (Channel("mass_x", "displacement"), shown), (Channel("drive_fx", "force"), drive),
    )  # fmt: skip


def _drops(rigid: Path, sprung: Path, repeats: tuple[int, ...]) -> list[Recording]:
    return [_dropped(rigid, sprung, repeat) for repeat in repeats]


def _dropped(rigid: Path, sprung: Path, repeat: int) -> Recording:
    """m/s^2 and N in the direction of the fall, of an accelerometer that shows 0 while it falls."""
    time, felt = loadmat(sprung)[f"{sprung.stem}{repeat}"][:, :2].T
    taken = (time > FELL) & (time < UNTIL)
    time, felt = time[taken], felt[taken]
    repeats = [values[:, :2].T for name, values in loadmat(rigid).items() if name.startswith(rigid.stem)]
    force = -(NOSE + BODY) * G * np.mean([np.interp(time, *each) for each in repeats], axis=0)
    return _recording(
        f"{sprung.stem}{repeat}", time,
        (Channel("body_ax", "acceleration"), -G * felt), (Channel("water_fx", "force"), force),
    )  # fmt: skip


def _recording(name: str, time: np.ndarray, *measured: tuple[Channel, np.ndarray]) -> Recording:
    channels, values = zip(*measured, strict=True)
    return Recording(Test(name, channels), np.rint(time * 1e9).astype(np.int64), np.stack(values, axis=1))


def _is_first(found: Diagnosis, effect: str, true: float, within: float) -> bool:
    """Whether the effect is named first, its coefficient within a share of the true one."""
    first = found.steps[0] if found.verdict == EFFECT_MISSING and found.steps else None
    return first is not None and first.effect == effect and abs(first.coefficient / true - 1.0) < within


def _is_friction(found: Diagnosis) -> bool:
    return _is_first(found, "coulomb_friction", FRICTION, WITHIN_OF_FRICTION)


def _is_spring(found: Diagnosis, spring: float) -> bool:
    return _is_first(found, "load_path", spring, WITHIN_OF_SPRING)


def _is_cubic(found: Diagnosis, tested: Recording) -> bool:
    named = found.verdict == EFFECT_MISSING and bool(found.steps) and found.steps[0].effect == "cubic_stiffness"
    return named and free_run_error(found, tested) < LARGEST_ERROR


def free_run_error(found: Diagnosis, recording: Recording) -> float:
    """RMS error of what was found, simulated under the force of another recording of the same system."""
    return float(predict(found, recording).error(RUNG_OUT)[0])
