"""Do the accelerometers of one body tell of the same motion? The outlier is found by what they integrate to.

Sensors on a rigid part may show quite different peaks, each its own panel's ringing, and still integrate to the same
change of velocity. So each sensor's velocity v_i(t) since the impact is compared with the median of all at each
instant:

    deviation_i = max |v_i - median(v)| / max |median(v)|

A sensor beyond TOLERANCE contradicts the others, where most of them agree: those of a car that turns while it crashes
may each tell another motion, and none is wrong. With two sensors the median cannot tell which is wrong: then the
momentum does, where the other side's is known (the force on the barrier, the other vehicle), or nobody can.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from .conditioning import ENOUGH_SAMPLES, integrate

TOLERANCE = 0.10
"""Of the change of velocity. NHTSA's test 10146, whose four sensors of the car are sound, has 0.026 at most."""
UNTIL = 0.15
"""s since the impact: later the cars roll, turn and are stopped by the hall's wall."""
BALANCE = 0.05
"""Share by which momentum may be out of balance: dummies and other loose masses lag behind the car."""
AT_REST = 0.5
"""m/s: a body that changes its velocity by less has not crashed, and shares of that say nothing."""


class Agreement(NamedTuple):
    """Of the sensors of one body, in the order given."""

    change: np.ndarray  # (sensors,) m/s, change of velocity until the end of the comparison
    deviation: np.ndarray  # (sensors,) share of the body's change of velocity
    outliers: tuple[int, ...]
    undecided: bool = False  # they contradict each other, and nothing says which are right


def agreement(time: np.ndarray, columns: Sequence[np.ndarray], momentum: float | None = None) -> Agreement:
    """Compare sensors (n,) in m/s^2 at time (n,) in s; `momentum` is the change of velocity in m/s, as a size, that the
    other side's momentum allows the body."""
    until = (time >= 0.0) & (time <= UNTIL)
    velocity = np.array([_velocity(time, column)[until] for column in columns])
    if not until.any() or not len(columns):
        nothing = np.zeros(len(columns))
        return Agreement(nothing, nothing, ())
    middle = np.median(velocity, axis=0)
    size = float(np.abs(middle).max())
    change = velocity[:, -1]
    deviation = np.abs(velocity - middle).max(axis=1) / max(size, AT_REST)
    if len(columns) < 2:
        return Agreement(change, deviation, ())
    if len(columns) > 2:
        off = tuple(np.flatnonzero(deviation > TOLERANCE).tolist())
        most_agree = 2 * len(off) < len(columns)
        return Agreement(change, deviation, off if most_agree else (), undecided=not most_agree)
    apart = np.abs(velocity[0] - velocity[1]).max() / max(np.abs(velocity).max(), AT_REST)
    if apart <= TOLERANCE:
        return Agreement(change, deviation, ())
    if momentum:
        off = np.abs(np.abs(change) / momentum - 1.0)
        if off.min() <= TOLERANCE < off.max():
            return Agreement(change, off, (int(np.argmax(off)),))
    return Agreement(change, deviation, (), undecided=True)


def velocity_change(time: np.ndarray, acceleration: np.ndarray) -> float:
    """m/s, of an acceleration (n,) from the impact until the end of the comparison."""
    until = (time >= 0.0) & (time <= UNTIL)
    return float(_velocity(time, acceleration)[until][-1]) if until.any() else 0.0


def impulse(time: np.ndarray, force: np.ndarray) -> float:
    """N s, of a force (n,) from the impact until the end of the comparison."""
    return velocity_change(time, force)


def balance(changes: Mapping[str, float], masses: Mapping[str, float], pushed: float | None = None) -> str:
    """A line on the momentum: of two bodies against each other, or of one against the `pushed` impulse in N s.

    changes in m/s and masses in kg by body; "" where there is nothing to compare.
    """
    momentum = {b: masses[b] * abs(change) for b, change in changes.items() if masses.get(b) and abs(change) > AT_REST}
    if pushed:
        momentum["barrier"] = abs(pushed)
    if len(momentum) != 2:
        return ""
    (one, first), (other, second) = momentum.items()
    apart = abs(first - second) / max(first, second, 1e-9)
    verdict = "balanced" if apart <= BALANCE else "NOT balanced: a sensor, a mass or a speed may be wrong"
    shown = f"{one} {first * 1e-3:.1f} kN s, {other} {second * 1e-3:.1f} kN s"
    return f"momentum in the first {UNTIL * 1e3:.0f} ms: {shown}, {apart:.1%} apart: {verdict}"


def _velocity(time: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
    """(n,) m/s since the impact, the offset before it removed."""
    before = acceleration[(time < 0.0) & np.isfinite(acceleration)]
    offset = before.mean() if len(before) >= ENOUGH_SAMPLES else 0.0
    return integrate(time, acceleration - offset)[0]
