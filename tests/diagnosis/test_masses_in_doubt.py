"""Masses that a model file states a few percent wrongly: what was taken in their place is said. Two bodies that
meet at a spring which carries compression only: half sines, without a simulator."""

import numpy as np
import pytest
import yaml

from crash_estimator.core.diagnosis import diagnose
from crash_estimator.model_file import ModelFile
from crash_replay.recording import Channel, Recording, Test

IMPACTOR, TARGET, STIFFNESS = 1400.0, 1200.0, 1.2e6  # kg, kg, N/m
MODEL = """
name: two bodies
bodies:
  impactor: {{mass: 1400, acceleration: impactor_ax}}
  target: {{mass: {target}, acceleration: target_ax}}
elements:
  bumper:
    between: [impactor, target]
    stiffness: {{estimate: true, initial: 800000, min: 0, shape: constant}}
    tension: none
"""


def collision(speed: float) -> Recording:
    """10 kHz, noise of 2 % of the peak."""
    time = np.arange(-400, 1200) * 1e-4
    reduced = IMPACTOR * TARGET / (IMPACTOR + TARGET)
    omega = np.sqrt(STIFFNESS / reduced)
    wave = np.where((time > 0.0) & (omega * time < np.pi), np.sin(omega * time), 0.0)
    peaks = speed * omega * reduced * np.array([-1.0 / IMPACTOR, 1.0 / TARGET])
    noise = 0.02 * np.random.default_rng(int(speed)).standard_normal((len(time), 2))
    channels = tuple(Channel(f"{body}_ax", "acceleration", body, "x") for body in ("impactor", "target"))
    test = Test(f"{speed:g} m/s", channels, initial_velocity={"impactor": speed})
    return Recording(test, np.arange(-400, 1200) * 100_000, peaks * (wave[:, None] + noise))


@pytest.mark.parametrize(("stated", "said"), [(TARGET, ""), (0.95 * TARGET, "target 2.")])
def test_masses_taken_otherwise_than_stated_are_said(stated, said):
    model = ModelFile.model_validate(yaml.safe_load(MODEL.format(target=stated))).structure()
    found = diagnose(model, [collision(6.0), collision(12.0)])
    assert found.verdict == "adequate"
    assert ("than stated" in found.text) == bool(said) and said in found.text
