"""Predictions of how far a car crushes and when it stands still, and how far off they were, as a table."""

from collections.abc import Sequence
from typing import NamedTuple

EVERY = 0.005
"""s of the crash between two rows."""


class Prediction(NamedTuple):
    time: float  # s since the impact at which it was made
    crush: float  # m, peak
    stands_still: float  # s since the impact


def told(predictions: Sequence[Prediction], crush: float, time: float, fired: Prediction | None) -> str:
    """crush, time: what came true, in m and s."""
    lines = ["  at ms  peak crush mm  error mm  stands still at ms  error ms"]
    last = -1
    for one in predictions:
        row = int(one.time / EVERY + 1e-6)  # 55.0 ms are 11 of them, though 0.055 / 0.005 is a little less
        if row > last:
            last = row
            peak, still = 1e3 * one.crush, 1e3 * one.stands_still
            lines.append(
                f"{1e3 * one.time:7.1f}  {peak:13.0f}  {peak - 1e3 * crush:+8.1f}"
                f"  {still:18.1f}  {still - 1e3 * time:+8.2f}"
            )
    if fired:
        lines.append(
            f"fired at {1e3 * fired.time:.1f} ms, {1e3 * (time - fired.time):.1f} ms before the car stood still: "
            f"{1e3 * fired.crush:.0f} mm of crush predicted"
        )
    else:
        lines.append("not fired")
    return "\n".join(lines)
