"""A link's spring and contact, one motion after the other, against its law written with arrays."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from crash_estimator.core.diagnosis.mechanics.spring import NO_CURVE, Law, Spring, spring

G = 240
DT = np.full(G, 1e-3)
CRUSH = 0.1 * np.sin(2.0 * np.pi * np.arange(G) / 100.0) * (1.0 + np.arange(G) / G)  # in, out, in further
RATE = np.gradient(CRUSH, 1e-3)
KNOTS = np.array([0.0, 0.03, 0.05, 0.09, 0.13, 0.21])
FORCES = np.array([0.0, 900.0, 1000.0, 2500.0, 2600.0, 5000.0])
CURVE = KNOTS, FORCES, np.array([-1, 3, 4, 5, 6, 7])


def law(curve=CURVE, gap=0.0, play=False, slope=0.0, one_way=True) -> Law:
    return Law(gap, play, slope > 0.0, slope, *curve, 2.0e4, one_way)


def run(of: Law, more=(), more_slope=()) -> Spring:
    return Spring(*spring(of, CRUSH, RATE, DT, np.array(more, float), np.array(more_slope, float)))


@pytest.mark.parametrize("gap", [0.0, 0.02])
@pytest.mark.parametrize("slope", [0.0, 8.0e4])
def test_a_curve_is_read_at_the_crush_or_on_the_way_back_below_its_peak(gap, slope):
    found = run(law(gap=gap, slope=slope))
    x = CRUSH - gap
    peak = np.maximum.accumulate(np.maximum(x, 0.0))
    unloading = (x < peak) & (slope > 0.0)
    at = np.where(unloading, peak, x)
    expected = np.interp(at, KNOTS, FORCES) - np.where(unloading, slope * (peak - x), 0.0)
    below = at < 0.0  # the first piece goes on
    expected[below] = at[below] * FORCES[1] / KNOTS[1]
    carries = (x > 0.0) & ~(unloading & (expected <= 0.0))
    assert_array_equal(found.carries, carries)
    assert_allclose(found.static, np.where(carries, expected, 0.0), atol=1e-9)
    assert_allclose(found.peak, peak)
    assert_array_equal(found.on_line, unloading)
    assert carries.any() and not carries.all() and len(np.unique(found.knot[:, 0])) > 3


@pytest.mark.parametrize("slope", [0.0, 8.0e4])
def test_the_forces_at_the_knots_are_weighted_by_where_it_is_read(slope):
    """The force is linear in them: so many times each as the force changes by where that one alone is changed."""
    found = run(law(slope=slope))
    for k in range(1, len(KNOTS)):
        forces = FORCES.copy()
        forces[k] += 1e-3
        moved = run(law((KNOTS, forces, CURVE[2]), slope=slope))
        both = (moved.carries == 1.0) & (found.carries == 1.0)
        weight = np.where(found.knot == CURVE[2][k], found.weight, 0.0).sum(axis=1)
        assert_allclose(weight[both], (moved.static - found.static)[both] / 1e-3, atol=1e-6)


@pytest.mark.parametrize("slope", [0.0, 8.0e4])
def test_its_slopes_are_those_of_its_force(slope):
    found = run(law(slope=slope), np.full(G, 50.0), np.full(G, 700.0))
    at = np.searchsorted(KNOTS[1:-1], found.at, side="right")
    by_at = np.diff(FORCES)[at] / np.diff(KNOTS)[at] + 700.0
    carries = found.carries == 1.0
    assert_allclose(found.kx, np.where(carries, np.where(found.on_line, slope, by_at), 0.0), atol=1e-9)
    assert_allclose(found.kp, np.where(found.on_line, by_at - slope, 0.0), atol=1e-9)
    plain = run(law(slope=slope))
    both = carries & (plain.carries == 1.0)
    assert_allclose((found.static - plain.static)[both], 50.0)


def test_play_leaves_a_gap_to_both_sides():
    found = run(law(NO_CURVE, gap=0.02, play=True, one_way=False))
    expected = np.sign(CRUSH) * np.maximum(np.abs(CRUSH) - 0.02, 0.0)
    assert_allclose(found.x, expected, atol=1e-12)
    assert_allclose(found.static, 2.0e4 * expected, atol=1e-9)
    assert_array_equal(found.carries, (np.abs(CRUSH) > 0.02).astype(float))
    inside = (found.gate > 0.0) & (found.gate < 1.0)
    assert_allclose(found.gate_slope[inside], np.sign(CRUSH[inside]) / (np.abs(RATE[inside]) * DT[inside]))


def test_a_contact_opens_over_the_step_in_which_it_closes():
    """Half of a step is in contact where the crush passes zero in its middle; all of it a step later."""
    crush = np.array([-0.02, -0.004, 0.0, 0.004, 0.02, 0.03])
    rate = np.full(6, 10.0)
    found = Spring(*spring(law(NO_CURVE), crush, rate, np.full(6, 1e-3), np.zeros(0), np.zeros(0)))
    assert_allclose(found.gate, [0.0, 0.1, 0.5, 0.9, 1.0, 1.0])
    assert_allclose(found.gate_slope, [0.0, 100.0, 100.0, 100.0, 0.0, 0.0])


@pytest.mark.parametrize(("rate", "carries"), [(5.0, 1.0), (-5.0, 0.5)])
def test_what_touches_at_time_zero_and_goes_in_carries_from_then_on(rate, carries):
    crush = rate * 1e-3 * np.arange(3)
    found = Spring(*spring(law(NO_CURVE), crush, np.full(3, rate), np.full(3, 1e-3), np.zeros(0), np.zeros(0)))
    assert found.gate[0] == found.crushed[0] == carries


@pytest.mark.parametrize("one_way", [True, False])
def test_a_linear_spring_pulls_only_where_it_may(one_way):
    found = run(law(NO_CURVE, one_way=one_way))
    carries = (CRUSH > 0.0) | (not one_way)
    assert_allclose(found.static, np.where(carries, 2.0e4 * CRUSH, 0.0))
    assert_allclose(found.kx, np.where(carries, 2.0e4, 0.0))
