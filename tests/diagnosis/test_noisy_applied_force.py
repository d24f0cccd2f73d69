"""A force that is measured with noise pushes a light nose, which no sensor shows, before a heavy body.

The truth is that of scipy's simulation of a linear system: it shares nothing with the diagnosis.
"""

import numpy as np
import pytest
from scipy.signal import StateSpace, lsim

from crash_estimator.core.derived_motion import with_accelerations
from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.diagnosis.observation.record import observe
from crash_estimator.core.diagnosis.parameterization.magnitudes import measure_magnitudes
from crash_replay.recording import Channel, Recording, Test

NOSE, BODY, STIFFNESS, DAMPING = 0.08, 0.6, 6000.0, 2.5
"""kg, N/m, N s/m: the two swing at 46 Hz."""
MODEL = """
name: dropped
bodies:
  nose: {mass: 0.08, applied: nose_fx}
  body: {mass: 0.6, acceleration: body_ax}
elements:
  mount:
    between: [nose, body]
    stiffness: %s
    damping: {estimate: true, initial: 1.0, min: 0.0}
"""


def dropped(seed: int, of_force: float = 2.0, of_acceleration: float = 0.5) -> Recording:
    """50 ms at 4 kHz, 30 ms of rest before; standard deviations of the noise in N and m/s^2."""
    fine = np.arange(-0.03, 0.05, 2.5e-5)
    force = -70.0 * np.where(fine > 0.0, fine / 5e-3 * np.exp(1.0 - fine / 5e-3), 0.0)
    stiffness, damping = (
        STIFFNESS * np.array([[-1.0, 1.0], [1.0, -1.0]]),
        DAMPING * np.array([[-1.0, 1.0], [1.0, -1.0]]),
    )
    mass = np.array([[NOSE], [BODY]])
    a = np.block([[np.zeros((2, 2)), np.eye(2)], [stiffness / mass, damping / mass]])
    b = np.array([[0.0], [0.0], [1.0 / NOSE], [0.0]])
    _, shown, _ = lsim(StateSpace(a, b, a[3:], b[3:]), force, fine - fine[0])
    rng = np.random.default_rng(seed)
    time, force, shown = fine[::10], force[::10], shown[::10]
    values = np.stack([shown, force], axis=1) + rng.normal(size=(len(time), 2)) * np.array([of_acceleration, of_force])
    channels = (Channel("body_ax", "acceleration", "body", "x"), Channel("nose_fx", "force", "nose", "x"))
    return Recording(Test(f"drop {seed}", channels), np.rint(time * 1e9).astype(np.int64), values)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_noise_of_a_force_that_is_applied_is_no_missing_effect(model, seed):
    """Its share in what the body is seen to do is as large as the accelerometer's own noise."""
    found = diagnose(model(MODEL % STIFFNESS), [dropped(seed)])
    assert found.verdict == "adequate" and found.complete, found.text


@pytest.mark.parametrize("seed", [4, 5, 6])
def test_a_spring_that_is_missing_is_told_in_that_noise(model, seed):
    """Not as a hysteresis that hardly yields."""
    found = diagnose(model(MODEL % 0.0), [dropped(seed)])
    assert (found.verdict, found.steps[0].effect) == ("effect_missing", "load_path"), found.text
    assert found.steps[0].coefficient == pytest.approx(STIFFNESS, abs=4.0 * found.steps[0].std)


def test_what_is_expected_of_a_spring_hangs_little_on_the_drift_of_a_motion_that_no_sensor_shows(model):
    """Of the momentum: a zero's error moves the nose by as much more as it is lighter."""
    structure, told, raw = model(MODEL % 0.0), [], []
    for error in (0.0, -4.0):
        recording = dropped(7, 0.0, 0.05)
        recording.values[recording.time_ns >= 0, 0] += error
        derived, recordings = with_accelerations(structure, [recording])
        magnitudes = measure_magnitudes(derived, [observe(derived, recordings[0])])
        told.append(magnitudes.change_of_distance(0, 1))
        raw.append(np.ptp(magnitudes.measured[0].x @ [1.0, -1.0]))
    assert raw[1] > 2.0 * raw[0], "else this shows less"
    assert told[1] == pytest.approx(told[0], rel=0.05)
