"""Small structures and recordings with known truth for the estimator tests: exact formulas, no simulator."""

import numpy as np

from crash_estimator.core.structure import Body, Coefficient, Element, Structure
from crash_replay.recording import Channel, Recording, Test

ESTIMATED = Coefficient(1.0e4, estimated=True)


def oscillator(stiffness: Coefficient = ESTIMATED, damping: Coefficient = Coefficient(), **element) -> Structure:
    """One 10 kg body on a spring and damper to a fixed wall, its crush and rate measured."""
    return Structure(
        "oscillator",
        (Body("block", 10.0, ("block_ax",)), Body("wall", fixed=True)),
        (Element("spring", ("block", "wall"), stiffness, damping, displacement="travel", velocity="speed", **element),),
    )


def oscillator_recording(
    stiffness: float = 2.0e4, damping: float = 50.0, noise: float = 0.0, seed: int = 0, n: int = 400, pre: int = 50
) -> Recording:
    """The exact free vibration x = A exp(-d t) sin(w t) of that body, at 10 kHz, with accelerometer noise."""
    time_ns = np.arange(-pre, n, dtype=np.int64) * 100_000
    t = np.maximum(time_ns * 1e-9, 0.0)
    decay = damping / 20.0
    w = np.sqrt(stiffness / 10.0 - decay**2)
    travel = 0.05 * np.exp(-decay * t) * np.sin(w * t)
    speed = 0.05 * np.exp(-decay * t) * (w * np.cos(w * t) - decay * np.sin(w * t))
    force = np.where(time_ns < 0, 0.0, stiffness * travel + damping * speed)
    acceleration = -force / 10.0 + noise * np.random.default_rng(seed).standard_normal(len(t))
    channels = (
        Channel("block_ax", "acceleration", "block", "x"),
        Channel("travel", "displacement"),
        Channel("speed", "velocity"),
    )
    return Recording(Test("vibration", channels), time_ns, np.column_stack([acceleration, travel, speed]))


def plain(function):
    """A compiled function as the Python that it is written in: for a few numbers nothing is compiled."""
    return getattr(function, "py_func", function)
