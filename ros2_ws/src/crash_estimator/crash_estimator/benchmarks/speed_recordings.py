"""Recordings and models of any size for the benchmarks: a chain of bodies against a wall, all of them ringing."""

from pathlib import Path

import numpy as np

from crash_replay.recording import Channel, Recording, Test

PRE_IMPACT = 0.01
"""s"""


def ringing(channels: int, seconds: float, rate: float = 10_000.0) -> Recording:
    """Decaying sines of some 100 m/s^2 at 5 Hz and above, with noise; for their cost, not for what they mean."""
    n, pre = round(seconds * rate), round(PRE_IMPACT * rate)
    time_ns = np.round((np.arange(n) - min(pre, n // 2)) * 1e9 / rate).astype(np.int64)
    time = np.maximum(time_ns * 1e-9, 0.0)
    values = np.random.default_rng(0).standard_normal((n, channels))
    for k in range(channels):
        values[:, k] -= 100.0 * np.exp(-time / 0.2) * np.sin(2.0 * np.pi * (5.0 + k) * time)
    names = tuple(Channel(f"b{k}_ax", "acceleration", f"b{k}", "x") for k in range(channels))
    velocity = {f"b{k}": 3.0 - 0.1 * k for k in range(channels)}
    return Recording(Test(f"ringing_{channels}", names, initial_velocity=velocity), time_ns, values)


def chain(bodies: int, path: Path) -> Path:
    """A model file: bodies b0, b1, ... with a spring and a damper each to the next, the last to a wall; all unknown.

    Without bounds: ringing is no crash, and a bound that is met and left all the time would be an event each time.
    """
    lines = [f"name: chain_{bodies}", "bodies:"]
    lines += [f"  b{k}: {{mass: 100, acceleration: b{k}_ax}}" for k in range(bodies)]
    lines += ["  wall: {fixed: true}", "elements:"]
    for k in range(bodies):
        end = f"b{k + 1}" if k + 1 < bodies else "wall"
        lines += [
            f"  e{k}:",
            f"    between: [b{k}, {end}]",
            "    stiffness: {estimate: true, initial: 1.0e5}",
            "    damping: {estimate: true, initial: 100.0}",
        ]
    path.write_text("\n".join(lines) + "\n")
    return path
