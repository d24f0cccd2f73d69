"""A measured crush counts from where it stands before the impact: pressed there, it would push, and nothing moves."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.fold import run
from crash_estimator.core.kinematics import Kinematics
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.structure import Body, Coefficient, Element, Structure
from crash_replay.recording import Channel, Recording, Test

MASS, STIFFNESS, SPEED = 0.6, 1.5e4, 1.5
ZERO, NOISE = 6e-5, 2e-6  # m


def on_a_spring(shift: np.ndarray | float) -> Recording:
    """80 ms at 10 kHz, 20 ms of them before the impact, of a body that a spring stops; shift: of the crush sensor."""
    time = np.arange(-0.02, 0.06, 1e-4)
    rng, frequency = np.random.default_rng(4), np.sqrt(STIFFNESS / MASS)
    crush = np.where(time < 0.0, 0.0, SPEED / frequency * np.sin(frequency * time))
    rate = np.where(time < 0.0, 0.0, SPEED * np.cos(frequency * time))
    a = -STIFFNESS * crush / MASS + rng.normal(0.0, 0.5, len(time))
    shown = crush + shift + rng.normal(0.0, NOISE, len(time))
    channels = (
        Channel("body_ax", "acceleration", "body"), Channel("crush", "displacement"), Channel("rate", "velocity"),
    )  # fmt: skip
    return Recording(Test("spring", channels), np.rint(time * 1e9).astype(np.int64), np.stack([a, shown, rate], axis=1))


SPRING = Element(
    "spring", ("body", "wall"), Coefficient(1e4, estimated=True, min=0.0, shape="constant"),
    displacement="crush", velocity="rate",
)  # fmt: skip
MODEL = Structure("spring", (Body("body", mass=MASS, acceleration=("body_ax",)), Body("wall", fixed=True)), (SPRING,))
ONE_WAY = replace(MODEL, elements=(replace(SPRING, tension=False),))


def crushes(structure: Structure, recording: Recording) -> np.ndarray:
    kinematics, found = Kinematics(structure, recording.test), []
    state = kinematics.init()
    for sample in recording.samples():
        state, motion = kinematics.step(state, sample)
        found.append(motion.crush[0])
    return np.array(found)[recording.time_ns >= 0]


@pytest.mark.parametrize("structure", [MODEL, ONE_WAY])
def test_where_it_stands_is_its_zero(structure):
    recording = on_a_spring(ZERO)
    after = recording.time_ns >= 0
    assert_allclose(crushes(structure, recording), recording.column("crush")[after] - ZERO, atol=3 * NOISE)


def test_what_stands_apart_and_carries_no_tension_is_left():
    recording = on_a_spring(-ZERO)
    assert_allclose(crushes(ONE_WAY, recording), recording.column("crush")[recording.time_ns >= 0])
    assert_allclose(crushes(MODEL, recording)[0], 0.0, atol=0.02 * ZERO + 3 * NOISE)


def test_a_gap_that_closes_is_left():
    before = np.minimum(np.arange(-0.02, 0.06, 1e-4), 0.0)
    recording = on_a_spring(SPEED * before)
    assert_allclose(crushes(MODEL, recording), recording.column("crush")[recording.time_ns >= 0])


@pytest.mark.parametrize("method", ["mrls", "constrained_kalman"])
def test_the_stiffness_is_that_of_the_spring(method):
    found = {}
    for structure in (MODEL, ONE_WAY):
        recording = on_a_spring(ZERO)
        estimator = make_estimator(structure, recording.test, method)
        last = run(estimator, (sample for sample in recording.samples() if sample.time < 0.02))[-1]
        found[structure is MODEL] = last.parameters[0]
    assert found[True] == pytest.approx(STIFFNESS, rel=0.02) and found[False] == pytest.approx(STIFFNESS, rel=0.02)


def test_no_effect_is_told_for_a_sensor_that_was_not_zeroed():
    found = diagnose(MODEL, [on_a_spring(ZERO)])
    assert (found.verdict, found.steps) == ("adequate", ()), found.text
    (stiffness,) = found.constants
    assert stiffness.value == pytest.approx(STIFFNESS, rel=0.01)
