"""Axes of a drawing that grow with the data: round numbers, few ticks (pure)."""

import math
from typing import NamedTuple


class Axis(NamedTuple):
    """A range in round numbers and its ticks."""

    low: float
    high: float
    step: float

    @property
    def ticks(self) -> list[float]:
        count = round((self.high - self.low) / self.step)
        return [self.low + k * self.step for k in range(count + 1)]

    def holds(self, low: float, high: float) -> bool:
        return self.low <= low and high <= self.high


def round_up(value: float) -> float:
    """The smallest of 1, 2, 5, 10, 20, 50, ... (times any power of ten) that is not below a positive value."""
    power = 10.0 ** math.floor(math.log10(value))
    for digit in (1, 2, 5):
        if digit * power >= value * (1 - 1e-9):
            return digit * power
    return 10.0 * power


def axis_for(low: float, high: float, intervals: int = 5) -> Axis:
    """The axis of at most about `intervals` intervals that holds low to high, and zero.

    What goes no more than a twentieth beyond zero is noise, and may stick out.
    """
    low, high = min(low, 0.0), max(high, 0.0)
    low, high = (0.0 if -low < high / 20 else low), (0.0 if high < -low / 20 else high)
    step = round_up(max(high - low, 1e-9) / intervals)
    return Axis(step * math.floor(low / step + 1e-9), step * math.ceil(high / step - 1e-9), step)


def text(value: float, step: float) -> str:
    """A tick's number with the digits that its step needs, and a minus sign."""
    digits = max(0, -math.floor(math.log10(step) + 1e-9))
    return f"{value + 0.0:.{digits}f}".replace("-", "−")
