"""The second generator's mechanics, against what can be solved by hand."""

from dataclasses import replace
from math import inf, pi, sqrt

import numpy as np
import pytest
from numpy.testing import assert_allclose

from crash_replay.second_generator.branches import (
    BoucWen,
    Dahl,
    Dashpot,
    DryFriction,
    LuGre,
    Orifice,
    Slider,
    SpringBeside,
    TanhFriction,
)
from crash_replay.second_generator.curves import Bilinear, Cubic, Folding, Plateau, Progressive, Stop, Straight, Sum
from crash_replay.second_generator.flowing import Maxwell, VentedGas
from crash_replay.second_generator.joint import Joint
from crash_replay.second_generator.machine import Body, Machine, Motion
from crash_replay.second_generator.rates import CowperSymonds, Logarithmic, Power
from crash_replay.second_generator.strange import Fracture, Rattle
from crash_replay.second_generator.structures import draw

M, V, K = 1000.0, 10.0, 4e5
W = sqrt(K / M)
TIMES = np.arange(-100, 3000) * 1e-4


def against_wall(joint: Joint, times=TIMES, mass=M, speed=V) -> Motion:
    return Machine((Body("car", mass, speed), Body("wall", inf)), {"it": joint}).run(times)


def one_way(curve=Straight(K), **more) -> Joint:
    return Joint("car", "wall", curve, **more)


def two_way(curve=Straight(K), **more) -> Joint:
    return Joint("car", "wall", curve, one_way=False, **more)


def test_an_elastic_bounce_takes_half_a_period_and_gives_all_back():
    motion = against_wall(one_way())
    inside = (TIMES >= 0.0) & (TIMES <= pi / W)
    assert_allclose(motion.x[inside, 0], V / W * np.sin(W * TIMES[inside]), atol=1e-6)
    assert_allclose(motion.v[-1, 0], -V, rtol=1e-6)
    turned, left = (when for when, _ in motion.events)
    assert_allclose([turned, left], [0.5 * pi / W, pi / W], atol=1e-8)


def test_before_the_impact_it_coasts():
    motion = against_wall(one_way())
    before = TIMES < 0.0
    assert_allclose(motion.x[before, 0], V * TIMES[before])
    assert not motion.a[before].any() and not motion.forces[before].any()


def test_what_unloads_along_a_line_gives_back_the_triangle_under_it():
    line = 8.0 * K
    motion = against_wall(one_way(unload=line))
    crush = V / W
    assert_allclose(motion.v[-1, 0], -sqrt((K * crush) ** 2 / line / M), rtol=1e-6)
    assert_allclose(motion.events[-1][0], 0.5 * pi / W + 0.5 * pi / sqrt(line / M), atol=1e-8)


def test_behind_a_gap_it_is_the_same_bounce_later():
    gap = 0.05
    motion = against_wall(one_way(gap=gap))
    assert_allclose(motion.events[0][0], gap / V, atol=1e-9)
    assert_allclose(motion.events[-1][0], gap / V + pi / W, atol=1e-8)


def test_within_its_play_a_two_way_element_carries_nothing():
    motion = against_wall(two_way(gap=0.02, branches=(Dashpot(500.0),)))
    free = np.abs(motion.x[:, 0]) < 0.0199
    assert not motion.forces[free & (TIMES > 0.0)].any()
    assert np.abs(motion.forces).max() > 0.5 * K * V / W


def test_dry_friction_takes_four_times_its_offset_each_cycle_and_then_holds():
    """Coulomb's decay: the peak falls by 2 f / K each half cycle, and it rests where the spring is held."""
    f = 2e4
    motion = against_wall(two_way(branches=(DryFriction(f),)), np.arange(0, 10000) * 1e-4)
    x, v = motion.x[:, 0], motion.v[:, 0]
    offset = f / K
    first = sqrt((V / W) ** 2 + offset**2) - offset
    peaks = [first - 2.0 * offset * n for n in range(int(first / (2.0 * offset)) + 1)]
    turning = [float(np.interp(when, motion.time, x)) for when, _ in motion.events]
    assert_allclose(np.abs(turning[: len(peaks)]), peaks, atol=1e-5)
    assert v[-1] == 0.0 and abs(K * x[-1]) <= f
    assert_allclose(motion.forces[-1], 0.0, atol=1e-6)  # the friction holds what the spring pulls


def test_a_block_on_a_floor_stops_where_its_energy_is_spent_and_stays():
    f = 3000.0
    motion = against_wall(two_way(Straight(0.0), branches=(DryFriction(f),)), np.arange(0, 40000) * 1e-4)
    assert_allclose(motion.x[-1, 0], 0.5 * M * V**2 / f, rtol=1e-7)
    assert_allclose(motion.events[0][0], M * V / f, atol=1e-7)
    assert not motion.v[-1].any()


def test_what_sticks_slips_again_when_it_is_pushed_harder_than_it_can_hold():
    f, rise = 3000.0, 1e5
    block = Body("car", M, 0.02, push=lambda t, v: -rise * t)
    machine = Machine((block, Body("wall", inf)), {"it": two_way(Straight(0.0), branches=(DryFriction(f),))})
    motion = machine.run(np.arange(0, 4000) * 1e-4)
    stuck, slipped = (when for when, _ in motion.events)
    assert_allclose(slipped, f / rise, atol=1e-8)  # it has stuck before, at 0.02 = (f + rise t / 2) t / M
    assert_allclose((f + 0.5 * rise * stuck) * stuck / M, 0.02, rtol=1e-5)
    held = (motion.time > stuck) & (motion.time < slipped)
    assert held.sum() > 100 and not motion.a[held, 0].any()
    assert motion.v[-1, 0] < 0.0


@pytest.mark.parametrize("branch", [TanhFriction(2e4, 0.01), Dahl(2e4, 1e-4), LuGre(2e4, 2e4, 0.1, 1e8, 0.0, 0.0)])
def test_smoothed_frictions_become_dry_friction(branch):
    sharp, smooth = (against_wall(two_way(branches=(b,))).x[:, 0] for b in (DryFriction(2e4), branch))
    assert_allclose(smooth, sharp, atol=0.02 * np.abs(sharp).max())


def test_a_friction_turns_with_the_contact_that_it_is_in_though_both_begin_at_rest():
    """Driven in and out from rest: phase and friction turn at the same instant, which is no event of one of them."""
    f, line = 2e3, 8.0 * K
    door = Body("car", 1.0, motion=lambda t: 50.0 * np.cos(2.0 * pi * t / 0.2))
    machine = Machine((door, Body("wall", inf)), {"it": one_way(unload=line, branches=(Dahl(f, 1e-4),))})
    motion = machine.run(np.arange(0, 1100) * 1e-4)
    x = motion.x[:, 0]
    back = (motion.time > 0.1) & (x < x.max() - 1e-3)
    on_line = K * x.max() - line * (x.max() - x[back])
    assert back.sum() > 10
    assert_allclose(motion.forces[back, 0], on_line - f, atol=1e-3 * f)


def test_a_linear_damper_decays_as_it_must():
    c = 4000.0
    motion = against_wall(two_way(branches=(Dashpot(c),)))
    late = TIMES >= 0.0
    d, wd = 0.5 * c / M, sqrt(K / M - (0.5 * c / M) ** 2)
    assert_allclose(motion.x[late, 0], V / wd * np.exp(-d * TIMES[late]) * np.sin(wd * TIMES[late]), atol=1e-6)


def test_a_quadratic_damper_alone_slows_by_one_over_its_travel():
    q = 50.0
    motion = against_wall(two_way(Straight(0.0), branches=(Orifice(q),)))
    late = TIMES >= 0.0
    assert_allclose(motion.v[late, 0], V / (1.0 + q * V / M * TIMES[late]), rtol=1e-6)


def test_a_contact_never_pulls_unless_it_is_told_to():
    damped = one_way(branches=(Dashpot(1e4),))
    assert against_wall(damped).forces.min() == 0.0
    assert against_wall(replace(damped, pulls=True)).forces.min() < -1000.0


def test_maxwells_branch_relaxes():
    k, c = 2e5, 1e3
    branch = Maxwell(k, c)
    motion = Machine((Body("a", inf, 1.0, motion=lambda t: 0.0), Body("b", inf)),
                     {"it": Joint("a", "b", Straight(0.0), False, branches=(branch,))}).run(TIMES)  # fmt: skip
    late = TIMES >= 0.0
    assert_allclose(motion.forces[late, 0], c * (1.0 - np.exp(-k / c * TIMES[late])), rtol=1e-5, atol=1e-4)


def test_a_slider_yields_at_its_force_and_dissipates_its_loop():
    f, d = 5e4, 0.02
    motion = against_wall(two_way(branches=(Slider(f, d),)))
    own = motion.forces[:, 0] - K * motion.x[:, 0]
    assert_allclose([own.max(), own.min()], [f, -f], rtol=1e-6)
    yielded = float(np.interp(d, motion.x[TIMES >= 0.0, 0][:300], TIMES[TIMES >= 0.0][:300]))
    assert_allclose(motion.events[0][0], yielded, atol=1e-5)


def test_bouc_and_wens_force_goes_to_its_yield_force():
    motion = against_wall(two_way(branches=(BoucWen(5e4, 0.01, 1.0, 0.5),)))
    own = motion.forces[:, 0] - K * motion.x[:, 0]
    assert_allclose(own.max(), 5e4, rtol=1e-3)


def test_what_breaks_has_taken_the_energy_of_its_spring():
    k, at = 2e5, 0.1
    motion = against_wall(two_way(Straight(0.0), branches=(Fracture(k, at),)))
    assert_allclose(motion.v[-1, 0], sqrt(V**2 - k * at**2 / M), rtol=1e-6)


def test_a_rattling_mass_keeps_the_momentum_and_loses_energy():
    bodies = (Body("car", 800.0, 3.0), Body("loose", 200.0))
    joint = Joint("car", "loose", Straight(0.0), False, branches=(Rattle(1e9, 0.15, 0.02),))
    motion = Machine(bodies, {"it": joint}).run(TIMES)
    momentum = 800.0 * motion.v[:, 0] + 200.0 * motion.v[:, 1]
    assert_allclose(momentum, 2400.0, rtol=1e-9)
    apart = [when for when, _ in motion.events][1]
    after = motion.v[np.searchsorted(TIMES, apart) + 1]
    assert 0.5 < (after[1] - after[0]) / 3.0 < 0.85  # 1 - 2/3 b v = 0.7, to first order


def test_a_closed_bag_gives_back_what_it_took_and_a_vented_one_does_not():
    closed, vented = (
        against_wall(two_way(Straight(0.0), branches=(VentedGas(5e4, 1.0, w),)), np.arange(0, 9000) * 1e-4)
        for w in (0.0, 5.0)
    )
    assert_allclose(closed.v[-1, 0], -V, rtol=1e-5)
    assert abs(vented.v[-1, 0]) < 0.9 * V


def test_the_momentum_of_a_structure_is_that_of_what_pushes_it():
    setup = draw("sled", np.random.default_rng(1), False, False, True)
    motion = setup.machine(1.0).run(TIMES)
    masses = [body.mass for body in setup.bodies]
    assert_allclose(motion.v @ masses, setup.bodies[0].mass * setup.bodies[0].v, rtol=1e-9)


def test_the_work_of_all_joints_is_what_the_kinetic_energy_has_lost():
    setup = draw("cab", np.random.default_rng(2), False, False, True)
    motion = setup.machine(1.0).run(np.arange(0, 1500) * 1e-4)
    masses = np.array([body.mass for body in setup.bodies[:2]])
    lost = 0.5 * (motion.v[0, :2] ** 2 - motion.v[-1, :2] ** 2) @ masses
    names = [body.name for body in setup.bodies]
    ends = [(names.index(j.a), names.index(j.b)) for j in setup.joints.values()]
    rates = np.column_stack([motion.v[:, a] - motion.v[:, b] for a, b in ends])
    power = (motion.forces * rates).sum(axis=1)
    assert_allclose(np.trapezoid(power, motion.time), lost, rtol=1e-4)  # the trapezoids' own error


def test_rates_begin_at_one_and_grow():
    for rate in (CowperSymonds(40.0, 4.0), Power(5.0, 0.4), Logarithmic(0.1, 0.3)):
        assert_allclose(rate.factor(1e-12), 1.0, atol=2e-3)
        assert rate.factor(10.0) > rate.factor(5.0) > 1.0


@pytest.mark.parametrize("curve", [
    Bilinear(K, 0.1, 0.5 * K), Progressive(K, 0.5, 0.3), Plateau(2.0 * K, 5e4, 0.3 * K), Stop(0.1, K, 1.5), Cubic(1e7),
    Folding(Straight(K), 0.2, 0.05), Sum((Straight(K), Stop(0.1, K))),
])  # fmt: skip
def test_curves_begin_at_zero_and_are_continuous(curve):
    u = np.linspace(0.0, 0.3, 3001)
    force = np.array([curve.force(one) for one in u])
    assert force[0] == 0.0
    assert np.abs(np.diff(force)).max() < 0.01 * force.max()


def test_an_elastic_spring_beside_gives_back_what_one_inside_the_curve_keeps():
    stop, line = Stop(0.1, K), 8.0 * K
    beside = against_wall(one_way(unload=line, branches=(SpringBeside(stop),)))
    inside = against_wall(one_way(Sum((Straight(K), stop)), unload=line))
    assert_allclose(beside.x.max(), inside.x.max(), rtol=1e-6)
    assert beside.v[-1, 0] < 1.2 * inside.v[-1, 0] < 0.0
