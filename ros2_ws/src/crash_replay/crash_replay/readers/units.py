"""Units of recordings, converted to SI here and nowhere else."""

from collections.abc import Mapping

from ..gravity import G
from ..recording import SI_UNIT, RecordingError
from ..yaml_schema import suggestion

DEGREE = 0.017453292519943295
"""rad"""
POUND_FORCE = 4.4482216152605
"""N"""
POUND_MASS = 0.45359237
"""kg"""
KMH = 1.0 / 3.6
"""m/s"""

FACTORS: Mapping[str, Mapping[str, float]] = {
    "acceleration": {
        "m/s^2": 1.0,
        "m/s2": 1.0,
        "m/(s*s)": 1.0,
        "m/s**2": 1.0,
        "m/s\N{SUPERSCRIPT TWO}": 1.0,
        "mm/s^2": 1e-3,
        "mm/ms^2": 1e3,
        "g": G,
        "G'S": G,
    },
    "velocity": {
        "m/s": 1.0,
        "mm/s": 1e-3,
        "mm/ms": 1.0,
        "km/h": KMH,
        "kph": KMH,
        "mph": 0.44704,
        "KPH": KMH,
        "MPH": 0.44704,
    },
    "displacement": {
        "m": 1.0,
        "mm": 1e-3,
        "cm": 1e-2,
        "dm": 1e-1,
        "km": 1e3,
        "um": 1e-6,
        "\N{MICRO SIGN}m": 1e-6,
        "\N{GREEK SMALL LETTER MU}m": 1e-6,
        "nm": 1e-9,
        "in": 0.0254,
        "ft": 0.3048,
        "MM": 1e-3,
        "CM": 1e-2,
        "CMS": 1e-2,
        "MET": 1.0,
        "INS": 0.0254,
    },
    "force": {"N": 1.0, "kN": 1e3, "lbf": POUND_FORCE, "NWT": 1.0, "LBS": POUND_FORCE, "KLB": 1e3 * POUND_FORCE},
    "moment": {
        "N*m": 1.0,
        "N m": 1.0,
        "Nm": 1.0,
        "N*mm": 1e-3,
        "Nmm": 1e-3,
        "kN*m": 1e3,
        "NWM": 1.0,
        "LBF": 0.3048 * POUND_FORCE,
    },
    "angular_velocity": {"rad/s": 1.0, "deg/s": DEGREE, "rpm": 6.0 * DEGREE, "DPS": DEGREE, "RPS": 1.0},
}
"""SI units per unit, by quantity. G'S, KPH, MM, NWT, NWM, DPS and others in capitals are NHTSA's codes, among them
LBF for pound-feet and LBS for pounds; m/(s*s) is ISO-MME's."""


def si_factor(quantity: str, unit: str) -> float:
    """SI units per `unit`; a RecordingError that names the known ones where it is none of the quantity."""
    if quantity not in FACTORS:
        raise RecordingError(f"unknown quantity {quantity!r}; {suggestion(quantity, list(SI_UNIT))}")
    known = FACTORS[quantity]
    if unit not in known:
        elsewhere = [other for other, units in FACTORS.items() if unit in units]
        hint = f"{unit} is a unit of {elsewhere[0]}" if elsewhere else f"expected one of {', '.join(known)}"
        raise RecordingError(f"unknown unit {unit!r} for {quantity}; {hint}")
    return known[unit]


def quantity_of(unit: str) -> str | None:
    """The quantity that has this unit, None where there is none."""
    return next((quantity for quantity, units in FACTORS.items() if unit in units), None)
