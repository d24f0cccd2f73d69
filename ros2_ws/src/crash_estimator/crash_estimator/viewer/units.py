"""SI inside, a crash engineer's units on the screen: g, kN (N for light bodies), mm, N/mm (= kN/m)."""

import math
from typing import NamedTuple


class Shown(NamedTuple):
    """How values of an SI unit are shown: shown value = factor * SI value."""

    unit: str
    factor: float


_SHOWN = {
    "m/s^2": Shown("g", 1 / 9.80665),
    "N": Shown("kN", 1e-3),
    "m": Shown("mm", 1e3),
    "N/m": Shown("N/mm", 1e-3),
    "N*s/m": Shown("N s/m", 1.0),
}

MM = 1e3


def shown(si_unit: str, light: bool = False) -> Shown:
    """The unit on the screen for an SI unit; any other is shown as it is. light: forces in N."""
    if light and si_unit == "N":
        return Shown("N", 1.0)
    return _SHOWN.get(si_unit, Shown(si_unit, 1.0))


def with_std(value: float, std: float) -> str:
    """Both to the first digit of the standard deviation, such as 1540 ± 20."""
    if not (std > 0 and math.isfinite(std)):
        return f"{value:.4g}"
    digits = -math.floor(math.log10(std))
    return f"{round(value, digits):.{max(digits, 0)}f} ± {round(std, digits):.{max(digits, 0)}f}"
