"""A free curve with a kink, as of a front that runs into a stiff stop, lacks nothing; its truth is scipy's."""

import numpy as np
import pytest
import yaml
from scipy.integrate import solve_ivp

from crash_estimator.core.diagnosis import diagnose
from crash_estimator.model_file import ModelFile
from crash_replay.recording import Channel, Recording, Test

MASS, STIFFNESS, HARDENS = 1200.0, 3e5, 6e5  # kg, N/m, N/m^3
MODEL = """
name: car with a stop
bodies:
  car: {mass: 1200, acceleration: car_ax}
  barrier: {fixed: true, force: barrier_fx}
elements:
  front: {between: [car, barrier], stiffness: {estimate: true, initial: 300000, min: 0, shape: curve}, tension: none}
"""


def crash(speed: float, stop: float, stiffness: float, seed: int) -> Recording:
    """10 kHz, noise of 1 % of the peak; stop: m of crush from which on the front is so much stiffer, N/m."""
    time = np.arange(-400, 2001) * 1e-4

    def force(x):
        return np.where(x > 0.0, STIFFNESS * x + HARDENS * x**3 + stiffness * np.maximum(x - stop, 0.0), 0.0)

    moving = solve_ivp(
        lambda t, y: [y[1], -force(y[0]) / MASS], (0.0, time[-1]), [0.0, speed], t_eval=time[time >= 0.0],
        max_step=5e-4, rtol=1e-8, atol=1e-10,
    )  # fmt: skip
    of_barrier = np.append(np.zeros(np.count_nonzero(time < 0.0)), force(moving.y[0]))
    values = np.stack([-of_barrier / MASS, of_barrier], axis=1)
    noise = 0.01 * np.random.default_rng(seed).standard_normal(values.shape) * np.abs(values).max(axis=0)
    channels = (Channel("car_ax", "acceleration", "car", "x"), Channel("barrier_fx", "force", "barrier", "x"))
    test = Test(f"{speed:g} m/s", channels, initial_velocity={"car": speed})
    return Recording(test, np.arange(-400, 2001) * 100_000, values + noise)


@pytest.mark.parametrize(("stop", "stiffness", "speeds"), [(0.4, 3e6, (8.0, 14.0)), (0.45, 6e6, (10.0, 16.0))])
def test_a_kink_within_a_cell_of_the_curve_is_no_gap(stop, stiffness, speeds):
    """A gap moves the knots, the first of which is where it closes: one of them onto the kink."""
    model = ModelFile.model_validate(yaml.safe_load(MODEL)).structure()
    found = diagnose(model, [crash(speed, stop, stiffness, k) for k, speed in enumerate(speeds)])
    assert found.verdict == "adequate", found.text
