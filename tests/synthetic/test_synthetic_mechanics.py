"""The simulator of test recordings: its force laws and its integration."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.constants import g as G
from scipy.integrate import quad
from scipy.interpolate import PchipInterpolator

from crash_replay.synthetic.curves import Curve, constant, stepped
from crash_replay.synthetic.forces import Slip, Spring
from crash_replay.synthetic.hidden.laws import vented_gas
from crash_replay.synthetic.integrate import simulate
from crash_replay.synthetic.recordings import BUILDERS
from crash_replay.synthetic.system import Body, Element, Motion, System

STIFFENING = Curve((0.0, 0.02, 0.05, 0.1), (1.0e5, 1.2e5, 2.0e5, 2.4e5))


def oscillator(spring: Spring, damping: float = 0.0, velocity: float = 2.0) -> System:
    """10 kg against a wall."""
    return System(
        (Body("block", 10.0, velocity), Body("wall")), (Element("spring", ("block", "wall"), spring, damping),)
    )


# --- force laws


def test_curve_is_scipys_pchip_and_constant_beyond_its_ends():
    x = np.linspace(0.0, 0.1, 301)
    assert_allclose([STIFFENING(v) for v in x], PchipInterpolator(STIFFENING.x, STIFFENING.y)(x), rtol=1e-13)
    assert STIFFENING(-1.0) == 1.0e5 and STIFFENING(5.0) == 2.4e5


def test_stepped_curve_changes_within_its_width_and_nowhere_else():
    curve = stepped((0.0, 8.0), (0.1, 3.0), (0.2, 5.0), width=0.01)
    assert [curve(x) for x in (0.0, 0.05, 0.1, 0.11, 0.15, 0.2, 0.21, 9.0)] == [8.0, 8.0, 8.0, 3.0, 3.0, 3.0, 5.0, 5.0]
    assert_allclose(curve(0.105), 5.5)


def test_plastic_spring_unloads_on_its_line_and_reloads_on_it():
    spring = Spring(constant(1.0e5), unloading=5.0e5)
    assert_allclose(spring(0.10, 1.0, 0.10), 1.0e4)
    assert_allclose(spring(0.09, -1.0, 0.10), 5.0e3)
    assert_allclose(spring(0.09, +1.0, 0.10), 5.0e3)
    assert spring(0.079, -1.0, 0.10) == 0.0


def test_unloading_slope_below_the_stiffness_is_refused():
    with pytest.raises(ValueError, match="unloading slope must be at least the largest stiffness 240000 N/m"):
        Spring(STIFFENING, unloading=2.0e5)


@pytest.mark.parametrize("spring", [Spring(STIFFENING, tension=False), Spring(STIFFENING, unloading=6.0e5)])
def test_compression_only_springs_never_pull(spring):
    forces = [
        spring(x, v, max(peak, x)) for x in np.linspace(-0.2, 0.2, 81) for v in (-5.0, 5.0) for peak in (0.0, 0.07)
    ]
    assert min(forces) == 0.0 and max(forces) > 1e4


@pytest.mark.parametrize("seed", range(5))
def test_plastic_spring_gives_back_less_than_it_took(seed):
    """On any path of crush the work put in so far, the integral of F dX, is never negative; some is lost for good."""
    spring, rng = Spring(STIFFENING, unloading=6.0e5), np.random.default_rng(seed)
    turns = np.append(rng.uniform(-0.03, 0.09, 12), 0.0)
    path = np.concatenate([np.linspace(a, b, 400) for a, b in pairwise(turns)])
    peak = np.maximum.accumulate(np.maximum(path, 0.0))
    force = np.array([spring(x, 0.0, p) for x, p in zip(path, peak)])
    work = np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(path))
    start = quad(lambda x: spring(x, 0.0, x), 0.0, max(turns[0], 0.0))[0]
    assert (start + work).min() > -1e-3  # J; the trapezium rule's error at the corners
    assert start + work[-1] > 10.0


# --- integration


def test_runge_kutta_is_of_fourth_order():
    """A linear oscillator turns exactly by w t in the plane of w x and v: half the step, a sixteenth of the error."""
    time, w = np.array([0.0, 0.05]), np.sqrt(1.0e5 / 10.0)

    def error(step: float) -> float:
        end = simulate(oscillator(Spring(constant(1.0e5))), time, step)
        return np.hypot(
            w * end.displacement[-1, 0] - 2.0 * np.sin(w * 0.05), end.velocity[-1, 0] - 2.0 * np.cos(w * 0.05)
        )

    ratios = [error(step) / error(step / 2.0) for step in (2e-3, 1e-3, 5e-4)]
    assert_allclose(ratios, 16.0, rtol=0.05)
    assert error(1e-5) < 1e-11


def test_conservative_system_keeps_its_energy():
    """Kinetic and stored energy stay constant to 1e-6, through swings of a stiffening spring between two bodies."""
    spring = Spring(STIFFENING)
    system = System((Body("a", 10.0, 3.0), Body("b", 25.0)), (Element("spring", ("a", "b"), spring),))
    history = simulate(system, np.linspace(0.0, 0.2, 201))
    kinetic = 0.5 * (history.velocity**2 @ [10.0, 25.0])
    knots = list(STIFFENING.x[1:-1])
    stored = [
        quad(lambda x: spring(x, 0.0, 0.0), 0.0, abs(x), points=knots, epsrel=1e-10)[0] for x in history.crush[:, 0]
    ]
    assert max(stored) > 0.7 * kinetic[0]
    assert_allclose(kinetic + stored, 45.0, rtol=1e-6)


def test_damper_takes_what_the_motion_loses():
    history = simulate(oscillator(Spring(constant(1.0e5)), damping=200.0), np.linspace(0.0, 0.1, 10_001))
    energy = 5.0 * history.velocity[:, 0] ** 2 + 0.5e5 * history.crush[:, 0] ** 2
    lost = np.trapezoid(200.0 * history.rate[:, 0] ** 2, history.time)
    assert_allclose(energy[0] - energy[-1], lost, rtol=1e-5)
    assert (np.diff(energy) <= 1e-9).all()


def test_a_gas_without_a_hole_is_pressed_to_many_times_the_pressure_outside():
    """As its equation has it, F = c ((1 - X / L)^-1.4 - 1): nothing holds its memory back, as yielding does."""
    c, length = 30.0, 0.5
    bag = Element("bag", ("block", "wall"), Spring(constant(0.0)), slip=Slip(c, vented_gas(length, 0.0)))
    history = simulate(System((Body("block", 10.0, 2.0), Body("wall")), (bag,)), np.linspace(0.0, 0.3, 31))
    expected = c * ((1.0 - history.crush[:, 0] / length) ** -1.4 - 1.0)
    assert expected.max() > 2.0 * c
    assert_allclose(history.force[:, 0], expected, atol=1e-4 * c)


def test_plastic_contact_rebounds_slower_than_it_came_and_leaves():
    """Of the energy only that under the unloading line comes back: v = v0 sqrt(K / Ku)."""
    history = simulate(oscillator(Spring(constant(1.0e5), unloading=9.0e5)), np.linspace(0.0, 0.06, 601))
    # the turn is taken at the end of a step of 10 us, at most 1e-4 rad past the peak; so is the separation
    assert_allclose(history.velocity[-1, 0], -2.0 / 3.0, rtol=1e-5)
    assert history.force[-1, 0] == 0.0 and history.force.min() == 0.0


def test_driven_body_moves_as_given_whatever_it_meets():
    motion = Motion((0.0, 0.01, 0.03), (0.0, 8.0, 5.0))
    system = System(
        (Body("door", displacement=-0.02, motion=motion), Body("rib", 16.8)),
        (Element("door_rib", ("door", "rib"), Spring(constant(1.0e5), tension=False)),),
    )
    history = simulate(system, np.linspace(0.0, 0.04, 401))
    at = history.velocity[[0, 100, 300, 400], 0]
    assert_allclose(at, [0.0, 8.0, 5.0, 5.0], atol=1e-9)
    travel = np.concatenate([[0.0], np.cumsum(0.5e-4 * (history.velocity[1:, 0] + history.velocity[:-1, 0]))])
    assert_allclose(history.displacement[:, 0], travel - 0.02, atol=1e-5)  # the trapezium rule's error
    assert history.velocity[-1, 1] > 1.0


def test_a_body_needs_a_mass_above_zero_and_a_driven_one_has_none():
    with pytest.raises(ValueError, match="body rib: the mass must be > 0 kg, got 0.0"):
        Body("rib", 0.0)
    with pytest.raises(ValueError, match="body door: a driven body has no mass"):
        Body("door", 80.0, motion=Motion((0.0, 1.0), (0.0, 0.0)))


@pytest.mark.parametrize("name", ["frontal_abrupt", "side_mdb_door_car", "side_dummy_unpadded"])
def test_the_step_is_fine_enough(name):
    """Half the step changes no acceleration by more than a third of an accelerometer's step of 0.03 g."""
    scenario = BUILDERS[name]()
    time = np.arange(0.0, scenario.duration, 5e-4)
    coarse, fine = simulate(scenario.system, time), simulate(scenario.system, time, 5e-6)
    assert_allclose(coarse.acceleration, fine.acceleration, atol=0.01 * G, rtol=0.0)
