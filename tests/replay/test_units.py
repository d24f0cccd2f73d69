"""Every unit that a reader knows, against its definition."""

import math

import pytest
from numpy.testing import assert_allclose

from crash_replay.gravity import G
from crash_replay.readers.units import FACTORS, POUND_MASS, quantity_of, si_factor

INCH, POUND, MILE = 0.0254, 0.45359237, 1609.344  # m, kg, m: international yard and pound (1959)
LBF = POUND * 9.80665  # N
DEGREE = math.pi / 180.0
BY_DEFINITION = {
    "acceleration": {
        "m/s^2": 1, "m/s2": 1, "m/(s*s)": 1, "m/s**2": 1, "m/s\N{SUPERSCRIPT TWO}": 1, "mm/s^2": 0.001,
        "mm/ms^2": 1000, "g": 9.80665, "G'S": 9.80665,
    },
    "velocity": {
        "m/s": 1, "mm/s": 0.001, "mm/ms": 1, "km/h": 1000 / 3600, "kph": 1000 / 3600, "KPH": 1000 / 3600,
        "mph": MILE / 3600, "MPH": MILE / 3600,
    },
    "displacement": {
        "m": 1, "MET": 1, "dm": 0.1, "cm": 0.01, "CM": 0.01, "CMS": 0.01, "mm": 0.001, "MM": 0.001, "km": 1000,
        "um": 1e-6, "\N{MICRO SIGN}m": 1e-6, "\N{GREEK SMALL LETTER MU}m": 1e-6, "nm": 1e-9, "in": INCH, "INS": INCH,
        "ft": 12 * INCH,
    },
    "force": {"N": 1, "NWT": 1, "kN": 1000, "lbf": LBF, "LBS": LBF, "KLB": 1000 * LBF},
    "moment": {
        "N*m": 1, "N m": 1, "Nm": 1, "NWM": 1, "N*mm": 0.001, "Nmm": 0.001, "kN*m": 1000, "LBF": 12 * INCH * LBF,
    },
    "angular_velocity": {
        "rad/s": 1, "RPS": 1, "deg/s": DEGREE, "DPS": DEGREE, "rpm": 2 * math.pi / 60,
    },
}  # fmt: skip


def test_every_quantity_and_unit_is_held_to_a_definition():
    assert {quantity: set(units) for quantity, units in FACTORS.items()} == {
        q: set(u) for q, u in BY_DEFINITION.items()
    }
    assert G == 9.80665


@pytest.mark.parametrize("quantity", BY_DEFINITION)
def test_a_unit_is_what_it_is_defined_as(quantity):
    for unit, factor in BY_DEFINITION[quantity].items():
        assert_allclose(si_factor(quantity, unit), factor, rtol=1e-12, err_msg=unit)
        assert quantity_of(unit) == quantity
    assert quantity_of("furlong") is None


def test_a_pound_is_that_of_1959():
    assert POUND_MASS == POUND
