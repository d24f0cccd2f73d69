"""Forces that hang on the way that a crush has gone: hysteresis, a Maxwell element, a gas cushion."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

from crash_estimator.core.effects import EFFECTS, vented_gas
from crash_estimator.core.effects.bouc_wen import trace

HYSTERESIS = {"yield_crush": 0.02, "exponent": 2.0}


def hysteresis(crush, start=0.0, **shapes):
    return EFFECTS["hysteresis"].memory(np.zeros(len(crush)), crush, start, **(shapes or HYSTERESIS))[0]


@settings(max_examples=50, deadline=None)
@given(way=arrays(float, 40, elements=st.floats(-0.1, 0.1, allow_subnormal=False)))
def test_hysteresis_takes_energy_in_whatever_goes_round_and_stays_within_its_yield_force(way):
    """Round and round the same way, what the first rounds have stored is given back, and something is always lost."""
    closed = np.repeat(np.concatenate([way, way[:1]]), 3)
    closed = np.tile(np.interp(np.linspace(0, 1, 2000), np.linspace(0, 1, len(closed)), closed), 3)
    z = hysteresis(closed)
    work = np.cumsum(0.5 * (z[1:] + z[:-1]) * np.diff(closed))
    assert np.abs(z).max() <= 1.0
    assert work[-1] - work[1999] >= -1e-3 * HYSTERESIS["yield_crush"]


def test_hysteresis_does_not_hang_on_the_rate_and_can_be_gone_on_with():
    crush = 0.1 * np.sin(np.linspace(0.0, 12.0, 400))
    whole = hysteresis(crush)
    slowly = hysteresis(np.interp(np.linspace(0, 399, 3991), np.arange(400), crush))[::10]
    assert_allclose(slowly, whole, atol=2e-3)
    start, one_by_one = 0.0, [0.0]
    for before, now in zip(crush, crush[1:], strict=False):
        start = hysteresis(np.array([before, now]), start)[-1]
        one_by_one.append(start)
    assert_array_equal(one_by_one, whole)


def test_hysteresis_is_in_its_limit_a_spring_behind_a_dry_slider():
    crush = np.concatenate([np.linspace(0.0, 0.1, 500), np.linspace(0.1, 0.0, 500)])
    z = hysteresis(crush, yield_crush=0.02, exponent=10.0)
    assert_allclose(z[:90], crush[:90] / 0.02, rtol=0.1)
    assert_allclose(z[300:500], 1.0, atol=1e-3)
    assert_allclose(z[-200:], -1.0, atol=1e-3)


@pytest.mark.parametrize("far", [1e30, np.inf, np.nan])
def test_hysteresis_of_a_motion_without_bounds_ends_at_once(far):
    z = hysteresis(np.array([0.0, far, 0.0]))
    assert np.all((np.abs(z) <= 1.0) | np.isnan(z))


def maxwell(time, crush, start=0.0, relaxation_time=0.01):
    return EFFECTS["maxwell_element"].memory(time, crush, start, relaxation_time=relaxation_time)


def test_a_maxwell_element_relaxes_as_its_equation_says():
    """Against a general integrator on a motion with bends, at uneven instants, and gone on with from where it was."""
    time = np.sort(np.random.default_rng(3).uniform(0.0, 0.08, 300))
    crush = np.interp(time, [0.0, 0.03, 0.05, 0.08], [0.0, 0.12, 0.05, 0.07])

    def flow(t, z):
        rate = (np.diff(crush) / np.diff(time))[np.clip(np.searchsorted(time, t) - 1, 0, len(time) - 2)]
        return rate - z / 0.01

    z = maxwell(time, crush)[0]
    exact = solve_ivp(flow, (time[0], time[-1]), [0.0], t_eval=time, max_step=2e-5).y[0]
    assert_allclose(z, exact, atol=3e-3 * np.abs(z).max())
    assert_array_equal(maxwell(time[100:], crush[100:], z[100])[0], z[100:])
    held = maxwell(np.array([0.0, 0.01, 0.02]), np.zeros(3), 0.5)[0]
    assert_allclose(held, 0.5 * np.exp([0.0, -1.0, -2.0]))


def test_a_maxwell_element_is_a_damper_where_it_relaxes_at_once_and_a_spring_where_it_never_does():
    time = np.linspace(0.0, 0.1, 1001)
    crush = 0.1 * np.sin(20.0 * time)
    z, kept, by_crush, _ = maxwell(time, crush, relaxation_time=1e-4)
    assert_allclose(z[50:] / 1e-4, 2.0 * np.cos(20.0 * time[50:]), atol=2e-2)
    assert_allclose(kept[1:], np.exp(-1.0))
    assert_allclose(by_crush[1:], 1.0 - np.exp(-1.0))
    assert_allclose(maxwell(time, crush, relaxation_time=1e6)[0], crush, atol=1e-7)


def cushion(time, crush, start=0.0, length=0.2, leak=0.0, form=""):
    return EFFECTS["gas_cushion"].memory(time, crush, start, length=length, leak=leak, form=form)


def test_a_tight_gas_cushion_is_an_adiabatic_spring_and_one_with_a_hole_loses_what_its_equation_says():
    time = np.linspace(0.0, 0.05, 2001)
    crush = 0.12 * np.sin(np.pi * time / 0.05)
    adiabatic = (1.0 - crush / 0.2) ** -1.4 - 1.0
    assert_allclose(cushion(time, crush)[0], adiabatic, atol=1e-9)
    boyle = 1.0 / (1.0 - crush / 0.2) - 1.0  # p V stays where the gas stays as warm as it is
    assert_allclose(cushion(time, crush, form="isothermal")[0], boyle, atol=1e-9)

    def left(t, m):
        over = max((m[0] / (1.0 - 0.6 * np.sin(np.pi * t / 0.05))) ** 1.4 - 1.0, 0.0)
        return [-25.0 * np.sqrt(over)]

    m = solve_ivp(left, (0.0, 0.025), [1.0], t_eval=time[:1001], max_step=1e-5).y[0]
    y = cushion(time, crush, leak=25.0)[0]
    assert_allclose(y[100:1001], (m / (1.0 - crush[:1001] / 0.2))[100:] ** 1.4 - 1.0, rtol=0.03)
    assert 0.0 < y.max() < 0.8 * adiabatic.max() and y[-1] == 0.0 and y.min() == 0.0
    assert_array_equal(cushion(time[700:], crush[700:], y[700], leak=25.0)[0], y[700:])


@pytest.mark.parametrize("far", [1e30, np.inf, np.nan])
def test_a_gas_cushion_pressed_without_bounds_ends_at_once(far):
    y = cushion(np.array([0.0, 0.01, 0.02]), np.array([0.0, far, 0.0]), leak=25.0)[0]
    assert np.all((y >= 0.0) & (y <= 50.0**1.4) | np.isnan(y))


@pytest.mark.parametrize("way", [0.0031, -0.0067, 0.093])
@pytest.mark.parametrize("start", [0.0, 0.6, -0.8])
def test_the_derivatives_of_hysteresis_are_those_of_its_force(way, start):
    """By the crush at the end of a step, and by what was remembered at its beginning."""

    def after(start, way):
        return trace(np.array([0.0, way]), start, 0.02, 2.0, 0.3)[0][1]

    _, by_before, by_crush = trace(np.array([0.0, way]), start, 0.02, 2.0, 0.3)
    h = 1e-7
    assert_allclose(by_crush[1], (after(start, way + h) - after(start, way - h)) / (2.0 * h), rtol=1e-4, atol=1e-4)
    assert_allclose(by_before[1], (after(start + h, way) - after(start - h, way)) / (2.0 * h), rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("before, now", [(0.05, 0.08), (0.12, 0.09), (-0.01, 0.03)])
@pytest.mark.parametrize("start", [0.2, 1.5])
def test_the_derivatives_of_a_gas_are_those_of_its_overpressure(before, now, start):
    """By what it was, by the crush at the end of the step and, with the other sign, by the one at its beginning."""

    def after(y=start, before=before, now=now):
        return vented_gas.trace(np.array([0.0, 1e-3]), np.array([before, now]), y, 0.2, 30.0, 1.4)[0][1]

    found = vented_gas.trace(np.array([0.0, 1e-3]), np.array([before, now]), start, 0.2, 30.0, 1.4)
    h = 1e-6
    slopes = [(after(**{k: v + h}) - after(**{k: v - h})) / (2.0 * h) for k, v in
              (("y", start), ("now", now), ("before", before))]  # fmt: skip
    assert_allclose([found[1][1], found[2][1], -found[3][1]], slopes, rtol=1e-6, atol=1e-9)
