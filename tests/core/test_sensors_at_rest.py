"""What is known of the sensors from their rest before the impact: their noise, and how well their zero is known."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from crash_estimator.core.kinematics import FEWEST, Kinematics
from crash_estimator.core.structure import Body, Coefficient, Element, Structure
from crash_replay.recording import Channel, Recording, Test

ZERO = np.array([3.0, -200.0])
"""m/s^2 and N."""


def rest(samples: int) -> Recording:
    """Of a car and the barrier behind it; the noise of each is of two values only, so that its variance is exact."""
    noise = np.where(np.arange(samples) % 2, 1.0, -1.0)[:, None] * np.array([5.0, 70.0])
    channels = (Channel("a", "acceleration", "car"), Channel("f", "force", "wall"))
    time_ns = np.arange(-samples, 2, dtype=np.int64) * 100_000
    values = np.concatenate([ZERO + noise, [ZERO, ZERO + [100.0, 4000.0]]])
    return Recording(Test("one", channels, initial_velocity={"car": 10.0}), time_ns, values)


def after_rest(samples: int):
    structure = Structure(
        "one",
        (Body("car", 100.0, ("a",)), Body("wall", fixed=True, force="f")),
        (Element("spring", ("car", "wall"), Coefficient(1e4, estimated=True)),),
    )
    recording = rest(samples)
    kinematics = Kinematics(structure, recording.test)
    state = kinematics.init()
    for sample in recording.samples():
        state, motion = kinematics.step(state, sample)
    return structure.equations, motion


def test_noise_and_zero_of_every_sensor_are_those_of_its_rest():
    n = 2000
    equations, motion = after_rest(n)
    of_equation = {k: row for row, k in enumerate(equations)}
    assert motion.noise[of_equation[0]] == pytest.approx(25.0, rel=0.01)
    assert motion.noise[of_equation[1]] == pytest.approx(4900.0, rel=0.01)
    assert_allclose(motion.sensors[1], np.array([25.0, 4900.0]) / n, rtol=0.01)
    assert motion.sensors[0, 0] == pytest.approx(25.0, rel=0.01)
    # what is left of the zeros is of the order of noise / n, for the noise comes in pairs
    assert_allclose(motion.measured[[of_equation[0], of_equation[1]]], [100.0, 4000.0], atol=1.0)


@pytest.mark.parametrize("samples", [0, FEWEST - 1])
def test_too_short_a_rest_tells_nothing(samples):
    _, motion = after_rest(samples)
    assert np.isnan(motion.noise).all() and not motion.sensors.any() and not motion.offset_variance.any()
