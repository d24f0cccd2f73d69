"""A body that is driven by what two sensors say of it, if they err as the parameters say."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from crash_estimator.core.diagnosis.mechanics.driven_motion import driven_by, driven_motion
from crash_estimator.core.diagnosis.mechanics.masses import measured_inertia
from crash_estimator.core.diagnosis.observation.grid import DRIVEN_MODES, modes_of, on_grid
from crash_estimator.core.diagnosis.observation.tracked_motion import tracked_acceleration
from crash_estimator.core.diagnosis.observation.trajectory import element_motion
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.effect import Addition
from crash_replay.conditioning import cfc_filter

TIME = np.arange(400) * 1e-4
LEFT, RIGHT = 300.0 * np.sin(120.0 * TIME), 280.0 * np.sin(120.0 * TIME + 0.1)
ERRORS = (("channel_gain", "left"), ("channel_offset", "left"), ("channel_delay", "left"), ("channel_gain", "right"))
FIRST_MODE = len(ERRORS)
COSINES = on_grid(TIME, np.arange(len(TIME)), np.arange(DRIVEN_MODES + 1))["cosines"]
THETA = np.concatenate([[0.05, 12.0, 3.3e-4, -0.03], np.linspace(4.0, 1.0, DRIVEN_MODES + 1)])


def experiment():
    terms = [
        SimpleNamespace(addition=Addition(EFFECTS[effect], channel), coefficient=k)
        for k, (effect, channel) in enumerate(ERRORS)
    ]
    bodies = [SimpleNamespace(driven=False), SimpleNamespace(driven=True, acceleration=("left", "right"))]
    layout = SimpleNamespace(
        structure=SimpleNamespace(bodies=bodies), bodies=("car", "door"), terms=terms, attached={},
        modes=({1: range(FIRST_MODE, len(THETA))},),
    )  # fmt: skip
    signals = {
        name: SimpleNamespace(time=TIME, values=values, on_grid=values)
        for name, values in (("left", LEFT), ("right", RIGHT))
    }
    return layout, SimpleNamespace(time=TIME, step=1e-4, signals=signals, cosines=COSINES), 0


def test_it_moves_with_the_mean_of_what_they_should_have_recorded():
    inside = TIME < TIME[-1] - 5e-4  # beyond, a delay has nothing to read
    late = np.interp(TIME + THETA[2], TIME, LEFT)
    course = EFFECTS["channel_offset"].course("", TIME)
    expected = 0.5 * ((late - THETA[1] * course) / (1.0 + THETA[0]) + RIGHT / (1.0 + THETA[3]))
    expected += COSINES @ THETA[FIRST_MODE:]
    found = driven_motion(experiment(), THETA)
    assert not found[:, 0].any()
    assert_allclose(found[inside, 1], expected[inside], atol=1e-9)


def test_its_derivatives_are_their_finite_differences():
    inside = TIME < TIME[-1] - 5e-4
    by = {(body, parameter): column for body, parameter, column in driven_by(experiment(), THETA)}
    assert set(by) == {(1, p) for p in range(len(THETA))}
    for p, size in enumerate(THETA):
        step = 0.1 * 1e-4 if ERRORS[p:] and ERRORS[p][0] == "channel_delay" else 1e-4 * abs(size)
        moved = [driven_motion(experiment(), THETA + sign * step * np.eye(len(THETA))[p])[:, 1] for sign in (1.0, -1.0)]
        slope = (moved[0] - moved[1]) / (2.0 * step)
        tolerance = 0.02 if step == 1e-5 else 1e-7  # between two samples the slope of what was recorded changes
        assert_allclose(by[1, p][inside], slope[inside], atol=tolerance * np.abs(slope).max(), err_msg=str(p))


@pytest.mark.parametrize(
    ("inflated", "step", "filtered"), [(True, 1e-4, True), (False, 1e-4, False), (True, 2e-3, False)]
)
def test_an_attached_body_pushes_without_its_ringing_where_noise_stands_for_that(inflated, step, filtered):
    """And sampling is fast enough for the filter."""
    a = np.column_stack([np.zeros_like(LEFT), LEFT + 50.0 * np.sin(2.0 * np.pi * 900.0 * TIME)])
    signals = {"car": SimpleNamespace(on_grid=a[:, 1])}
    record = SimpleNamespace(dt=np.full(len(TIME), step), noise_is_inflated=inflated, signals=signals)
    car = SimpleNamespace(body_index={"cab": 0}, bodies=[SimpleNamespace(acceleration=("car",))])
    inertia = measured_inertia(SimpleNamespace(attached={"box": 1}, structure=car), record, SimpleNamespace(a=a))
    for channel in ("box", "car"):  # as that of a body of the model, whose mass varies
        assert_allclose(inertia(channel), cfc_filter(a[:, 1], step, 60) if filtered else a[:, 1])


def test_an_element_is_crushed_by_what_its_first_end_goes_towards_its_second():
    x = np.column_stack([0.3 * np.sin(40.0 * TIME), 0.1 * np.sin(40.0 * TIME)])
    v = np.gradient(x, TIME, axis=0)
    structure = SimpleNamespace(ends=np.array([[0, 1]]), elements=[SimpleNamespace(displacement=None, velocity=None)])
    found = element_motion(structure, SimpleNamespace(time=TIME), SimpleNamespace(x=x, v=v), 0)
    assert_allclose(found.crush, 0.2 * np.sin(40.0 * TIME), atol=1e-15)
    assert_allclose(found.rate, v[:, 0] - v[:, 1])
    assert_allclose(found.peak, np.maximum.accumulate(found.crush))


def test_the_acceleration_of_a_displacement_that_is_reached_anyway_is_its_own():
    """x = x0 + v0 t + b t^3 / 6 is what a = b t integrates to: an observer has nothing to correct."""
    time, x0, v0, b = np.arange(50) * 1e-3, 0.3, 2.0, 400.0

    def displacement(t, n=0):
        return (x0 + v0 * t + b * t**3 / 6.0, v0 + b * t**2 / 2.0, b * t)[n]

    assert_allclose(tracked_acceleration(time, displacement, x0, v0), b * time, atol=1e-6)
    off = tracked_acceleration(time, displacement, x0 + 1e-3, v0)
    dt = 1e-3
    v = v0 + np.concatenate([[0.0], np.cumsum(0.5 * dt * (off[1:] + off[:-1]))])
    x = x0 + 1e-3 + np.concatenate([[0.0], np.cumsum(dt * v[:-1] + dt * dt * (2.0 * off[:-1] + off[1:]) / 6.0)])
    assert abs(x[-1] - displacement(time[-1])) < 1e-5, "a start that is off by 1 mm is forgotten"


def test_a_driving_sensor_s_noise_is_known_where_a_body_rings():
    """A pulse is slow; what rings with 40 half periods amplifies the noise around those. A dead output says nothing."""
    time = (np.arange(1000) + 0.5) / 1000.0
    pulse, ringing = np.sin(np.pi * np.minimum(time / 0.3, 1.0)), np.cos(40.0 * np.pi * time)
    ringing[:3] = np.nan
    still = np.zeros(1000)
    assert_array_equal(modes_of(np.column_stack([pulse, still])), np.arange(DRIVEN_MODES + 1))
    assert_array_equal(modes_of(np.column_stack([still, ringing])), [0, 1, 2, *range(35, 45)])
