"""The sensitivities of a small made-up system against its equations of motion, written with matrices."""

from typing import NamedTuple

import numpy as np
import pytest
from numpy.testing import assert_allclose

from crash_estimator.core.diagnosis.mechanics.linear_system import Linear, Sampling
from crash_estimator.core.diagnosis.output_error.sensitivity_equations import propagate, respond
from crash_estimator.core.diagnosis.parameterization.layout import DRIVEN, FIXED, FREE

INSTANTS, OTHERS, KNOTS = 24, 5, 3
DT = 5e-3
"""s: long enough that the end of a step feeds back into its own acceleration by a tenth."""
KIND = np.array([FREE, FREE, DRIVEN, FIXED])
INVERSE_MASS = np.array([0.5, 2.0, 0.0, 1.0])
ENDS = np.array([[0, 1], [1, 3], [0, 2], [1, 3]])
CRUSH_ENDS = np.array([[0, 1], [1, 3], [0, 2], [-1, -1]])  # the last one's crush is measured


def system(observer: float) -> Linear:
    rng = np.random.default_rng(4)
    shape = len(ENDS), INSTANTS
    acts = rng.normal(size=(4, INSTANTS))
    knot = np.full((*shape, 2), -1)
    for t in range(3, INSTANTS):  # the curve is used up one knot after the other, on two links
        knot[0, t] = min(t // 8, KNOTS - 2), min(t // 8, KNOTS - 2) + 1
        knot[3, t, 1] = 0
    remembers = np.array([0, 1, 3])
    memory, loading = (len(remembers), INSTANTS), rng.random(shape) < 0.6
    return Linear(
        dt=np.where(np.arange(INSTANTS) == 0, 0.0, np.where(np.arange(INSTANTS) < 12, DT, 1.5 * DT)),
        ends=ENDS, crush_ends=CRUSH_ENDS, inverse_mass=INVERSE_MASS, kind=KIND,
        kx=rng.uniform(500.0, 2000.0, shape), kv=rng.uniform(5.0, 20.0, shape),
        kp=np.where(loading, 0.0, rng.uniform(-900.0, 900.0, shape)),
        loading=loading, knot=knot, weight=rng.normal(size=(*shape, 2)),
        changed=np.ones(INSTANTS, dtype=bool), observer=observer, others=OTHERS,
        start=np.where(KIND[:, None] == FIXED, 0.0, rng.normal(size=(2, len(KIND), OTHERS))),
        column=np.array([0, 1, 2, 4]), body=np.array([0, 1, 2, 3]), acts=acts,
        remembers=remembers, kept=rng.uniform(0.5, 0.9, memory), by_crush=rng.normal(size=memory),
        by_before=rng.normal(size=memory), recalled=rng.normal(0.0, 50.0, memory),
        touched=np.where(np.arange(INSTANTS) < 3, 0, np.where(np.arange(INSTANTS) < 16, 2, KNOTS)),
    )  # fmt: skip


class Motion(NamedTuple):
    """(g, b, columns): of every column, what the bodies do and what pushes them."""

    x: np.ndarray
    v: np.ndarray
    a: np.ndarray
    row: np.ndarray


def stepped(s: Linear) -> Motion:
    """The acceleration is a straight line within a step, at whose end it obeys the equations: one linear solve."""
    b, n = len(s.kind), s.others + KNOTS
    x, v, a, peak = np.zeros((b, n)), np.zeros((b, n)), np.zeros((b, n)), np.zeros((len(s.ends), n))
    v[:, : s.others], x[:, : s.others] = s.start
    memory, found = np.zeros((len(s.remembers), n)), []
    free, driven, fixed = s.kind == FREE, s.kind == DRIVEN, s.kind == FIXED
    push = np.zeros((b, len(s.ends)))  # acceleration of each body (or force on a fixed one) by each link's force
    for link, (near, far) in enumerate(s.ends):
        push[near, link], push[far, link] = -s.inverse_mass[near], s.inverse_mass[far]
    push[driven] = 0.0
    crush = np.zeros((len(s.ends), b))
    for link, (near, far) in enumerate(s.crush_ends):
        if near >= 0:
            crush[link, near], crush[link, far] = 1.0, -1.0
    for t, dt in enumerate(s.dt):
        outside = np.zeros((b, n))
        np.add.at(outside, (s.body, s.column), s.acts[:, t])
        known = np.zeros((len(s.ends), n))
        for link in range(len(s.ends)):
            known[link] += (s.kp[link, t] if crush[link].any() else 0.0) * peak[link]
            for end in range(2):
                if s.knot[link, t, end] >= 0:
                    known[link, s.others + s.knot[link, t, end]] += s.weight[link, t, end]
        for m, link in enumerate(s.remembers):
            memory[m] = s.kept[m, t] * memory[m] - s.by_before[m, t] * (crush[link] @ x)
            known[link] += s.recalled[m, t] * memory[m]
        slope_x, slope_v = (push @ (k[:, t, None] * crush) for k in (s.kx, s.kv))
        slope_x[free] -= s.observer**2 * np.eye(b)[free]
        slope_v[free] -= 2.0 * s.observer * np.eye(b)[free]
        ahead_x, ahead_v = x + dt * v + dt**2 / 3.0 * a, v + dt / 2.0 * a
        ahead_x[driven] += dt**2 / 6.0 * outside[driven]
        ahead_v[driven] += dt / 2.0 * outside[driven]
        ahead_x[fixed], ahead_v[fixed] = 0.0, 0.0
        pushed = outside + push @ known + slope_x @ ahead_x + slope_v @ ahead_v
        feedback = (dt**2 / 6.0 * slope_x + dt / 2.0 * slope_v)[np.ix_(free, free)]
        a = np.zeros((b, n))
        a[free] = np.linalg.solve(np.eye(free.sum()) - feedback, pushed[free])
        x, v = ahead_x + dt**2 / 6.0 * np.where(free[:, None], a, 0.0), ahead_v + dt / 2.0 * a
        a[driven] = outside[driven]
        x[fixed], v[fixed] = 0.0, 0.0
        for link in range(len(s.ends)):
            if s.loading[link, t] and crush[link].any():
                peak[link] = crush[link] @ x
        force = known + s.kx[:, t, None] * (crush @ x) + s.kv[:, t, None] * (crush @ v)
        row = np.where(free[:, None] | driven[:, None], a, outside + push @ force)
        row[free] += s.observer**2 * x[free] + 2.0 * s.observer * v[free]
        for m, link in enumerate(s.remembers):
            memory[m] += s.by_crush[m, t] * (crush[link] @ x)
        found.append((x, v, a, row))
    return Motion(*map(np.array, zip(*found, strict=True)))


def shown(s: Linear, of_motion: int, gain=1.0, lag=0, fraction=0.0) -> np.ndarray:
    """(g, b, columns) that `propagate` gives where every body is an output and every instant a bin of its own."""
    b = len(s.kind)
    out = np.zeros((INSTANTS, b, s.others + KNOTS))
    sampling = Sampling(
        np.arange(b), np.full(b, of_motion), np.full(b, gain), np.full(b, lag), np.full(b, fraction),
        np.arange(INSTANTS), np.ones((INSTANTS, b)),
    )  # fmt: skip
    propagate(s, sampling, out)
    return out


@pytest.mark.parametrize("observer", [0.0, 15.0])
def test_the_columns_obey_the_linear_equations_of_motion(observer):
    s = system(observer)
    expected = stepped(s)
    for of_motion, name in enumerate(("row", "v", "x")):
        wanted = getattr(expected, name)
        moving = s.kind != FIXED if of_motion else np.ones(len(s.kind), dtype=bool)
        found = shown(s, of_motion)
        assert_allclose(found[:, moving], wanted[:, moving], atol=1e-9 * np.abs(wanted).max(), rtol=0.0, err_msg=name)


@pytest.mark.parametrize("observer", [0.0, 15.0])
def test_one_pass_with_a_change_is_the_sum_of_the_columns(observer):
    s = system(observer)
    change = np.random.default_rng(5).normal(size=s.others + KNOTS)
    change[1] = 0.0
    found, free = respond(s, change), s.kind == FREE
    expected = stepped(s).a @ change
    assert_allclose(found[:, free], expected[:, free], atol=1e-9 * np.abs(expected).max(), rtol=0.0)


def test_an_output_shows_what_was_a_lag_ago_between_two_steps():
    s = system(0.0)
    now, late = shown(s, 1), shown(s, 1, gain=-2.0, lag=2, fraction=0.25)
    assert not late[:2].any()  # before the impact there was nothing to be seen
    before = np.concatenate([np.zeros_like(now[:3]), now])
    expected = -2.0 * (0.75 * before[1:-2] + 0.25 * before[:-3])
    assert_allclose(late[3:], expected[3:], atol=1e-12 * np.abs(now).max())
