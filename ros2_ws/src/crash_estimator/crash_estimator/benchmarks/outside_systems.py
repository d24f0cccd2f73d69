"""Other people's systems for `outside`: a free body that a measured force pushes, observed by its displacement."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.io import loadmat

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


def other_systems(folder: Path) -> Iterator:
    """Of what the folder has."""
    axis, oscillator = folder / "emps" / "DATA_EMPS.mat", folder / "silverbox" / "SNLS80mV.csv"
    if axis.exists():
        truth = f"dry friction of {FRICTION} N, then a constant force"
        yield Case("EMPS, an axis pushed by a motor, 24.8 s", lambda: [_axis(axis)], AXIS, truth, _is_friction)
    if oscillator.exists():
        tested = _oscillator(oscillator, TESTED)
        yield Case(
            "Silverbox, an oscillator, 8192 samples", lambda: [_oscillator(oscillator, TRAINED)], OSCILLATOR,
            f"a cubic stiffness; free run of another burst within {1e3 * LARGEST_ERROR:g} mV",
            lambda found: _is_cubic(found, tested), lambda found: f"{1e3 * free_run_error(found, tested):.2g} mV",
        )  # fmt: skip


def _axis(path: Path) -> Recording:
    data = loadmat(path)
    time = data["t"].ravel() - data["t"].ravel()[0]
    force = data["gtau"].item() * data["vir"].ravel()
    return _recording("emps", time, ("axis_x", data["qm"].ravel()), ("motor_fx", force))


def _oscillator(path: Path, samples: slice) -> Recording:
    drive, shown = np.genfromtxt(path, delimiter=",", skip_header=1, usecols=(0, 1))[samples].T
    return _recording("silverbox", np.arange(len(shown)) / SAMPLING, ("mass_x", shown), ("drive_fx", drive))


def _recording(name: str, time: np.ndarray, motion: tuple, force: tuple) -> Recording:
    channels = Channel(motion[0], "displacement"), Channel(force[0], "force")
    return Recording(
        Test(name, channels), np.rint(time * 1e9).astype(np.int64), np.stack([motion[1], force[1]], axis=1)
    )


def _is_friction(found: Diagnosis) -> bool:
    if found.verdict != EFFECT_MISSING or not found.steps:
        return False
    first = found.steps[0]
    return first.effect == "coulomb_friction" and abs(first.coefficient / FRICTION - 1.0) < WITHIN_OF_FRICTION


def _is_cubic(found: Diagnosis, tested: Recording) -> bool:
    named = found.verdict == EFFECT_MISSING and bool(found.steps) and found.steps[0].effect == "cubic_stiffness"
    return named and free_run_error(found, tested) < LARGEST_ERROR


def free_run_error(found: Diagnosis, recording: Recording) -> float:
    """RMS error of what was found, simulated under the force of another recording of the same system."""
    return float(predict(found, recording).error(RUNG_OUT)[0])
