"""A million samples through each method: is the covariance still one, and does the memory stay as it was?"""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from crash_replay.recording import Channel, Sample, Test

from ..core.methods import make_estimator
from ..core.structure import Body, Coefficient, Element, Structure

METHODS = ("rls", "mrls", "kalman", "constrained_kalman", "gauss_newton", "afmm", "effective_mass")
MASS, STIFFNESS, DAMPING = 10.0, 2.0e4, 50.0
NOISE = 0.5  # m/s^2, N
BLOCK = 1000  # samples made at once
CHECKED = 997
"""Every so many samples the covariance is looked at: a number that goes into no period of the motion."""
SETTLED = 0.1
"""Share of the samples after which the memory is what it must stay."""


class Endured(NamedTuple):
    """What came of one method."""

    method: str
    samples: int
    finite: bool  # every parameter and every covariance that was looked at
    asymmetry: float  # largest |P - P'| over |P|
    least_eigenvalue: float  # of the covariance scaled to a diagonal of one; at worst
    settled: int  # bytes of memory after SETTLED of the samples
    end: int  # bytes


def endure(method: str, samples: int) -> Endured:
    estimator = make_estimator(structure(), TEST, method)
    state = estimator.init()
    finite, asymmetry, least, settled = True, 0.0, np.inf, 0
    for sample in vibration(samples):
        state, estimate = estimator.step(state, sample)
        if sample.number % CHECKED == 0 or sample.number == samples - 1:
            finite &= bool(np.isfinite(estimate.parameters).all() and np.isfinite(estimate.covariance).all())
            asymmetry, least = (
                max(asymmetry, _asymmetry(estimate.covariance)),
                min(least, least_eigenvalue(estimate.covariance)),
            )
        if sample.number == round(SETTLED * samples):
            settled = resident()
    return Endured(method, samples, finite, asymmetry, least, settled, resident())


TEST = Test(
    "vibration",
    (
        Channel("block_ax", "acceleration", "block", "x"),
        Channel("travel", "displacement"),
        Channel("speed", "velocity"),
        Channel("wall_fx", "force", "wall"),
    ),
)


def structure() -> Structure:
    """A body on a spring and a damper before a wall, whose force is measured."""
    spring = Element(
        "spring",
        ("block", "wall"),
        Coefficient(1.0e4, estimated=True),
        Coefficient(0.0, estimated=True),
        displacement="travel",
        velocity="speed",
    )
    bodies = Body("block", MASS, ("block_ax",)), Body("wall", fixed=True, force="wall_fx")
    return Structure("endurance", bodies, (spring,))


def vibration(samples: int) -> Iterator[Sample]:
    """At 10 kHz, with noise and, now and then, a dropout; made as it is wanted, so that it takes no memory."""
    random = np.random.default_rng(0)
    for start in range(0, samples, BLOCK):
        number = np.arange(start, min(start + BLOCK, samples))
        t = number * 1e-4
        swing = 60.0 + 20.0 * np.sin(0.3 * t)  # rad/s: no two periods are the same
        travel, speed = 0.05 * np.sin(swing * t), 0.05 * swing * np.cos(swing * t)
        force = STIFFNESS * travel + DAMPING * speed
        noise = NOISE * random.standard_normal((2, len(t)))
        block = np.column_stack([-force / MASS + noise[0], travel, speed, force + noise[1]])
        block[number % 7001 == 7000, 0] = np.nan
        for k, values in zip(number.tolist(), block):
            yield Sample(k, k * 100_000, values)


def _asymmetry(covariance: np.ndarray) -> float:
    return float(np.abs(covariance - covariance.T).max() / max(np.abs(covariance).max(), 1e-300))


def least_eigenvalue(covariance: np.ndarray) -> float:
    """Of the covariance (p, p) scaled to a diagonal of one; inf where there is none."""
    scale = np.sqrt(np.abs(np.diagonal(covariance)))
    kept = scale > 0.0
    if not kept.any():
        return np.inf
    return float(np.linalg.eigvalsh(covariance[np.ix_(kept, kept)] / np.outer(scale[kept], scale[kept])).min())


def resident(process: int | str = "self") -> int:
    """Bytes of memory that a process has in use; 0 where there is none."""
    try:
        return int(Path(f"/proc/{process}/statm").read_text().split()[1]) * 4096
    except OSError:
        return 0
