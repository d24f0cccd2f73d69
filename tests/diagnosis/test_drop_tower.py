"""A head that falls on foam: its accelerometer shows how fast it falls less than freely, not how its speed changes."""

import numpy as np
import pytest
import yaml
from scipy.integrate import solve_ivp

from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.structure import Structure
from crash_estimator.model_file import ModelFile
from crash_replay.gravity import G
from crash_replay.recording import Channel, Recording, Test

MASS, STIFFNESS, DAMPING = 6.8, 4e4, 60.0  # kg, N/m, N s/m
RATE, BEFORE, AFTER = 10_000, 0.03, 0.05  # Hz, s, s

MODEL = f"""
name: drop
bodies:
  head: {{mass: {MASS}, acceleration: head_az}}
  table: {{fixed: true, force: table_fz}}
elements:
  foam:
    between: [head, table]
    stiffness: {{estimate: true, initial: 30000.0, min: 0.0, shape: constant}}
    damping: {{estimate: true, initial: 30.0, min: 0.0, shape: constant}}
    tension: none
"""
FALLS = """
effects:
- {type: constant_force, body: head}
- {type: channel_offset, channel: head_az}
"""


def structure(text: str) -> Structure:
    return ModelFile.model_validate(yaml.safe_load(text)).structure()


def drop(speed: float) -> Recording:
    def foam(x, v):
        return np.where(x > 0.0, np.maximum(STIFFNESS * x + DAMPING * v, 0.0), 0.0)

    way = solve_ivp(
        lambda t, x: (x[1], G - float(foam(*x)) / MASS), (0.0, AFTER), (0.0, speed), dense_output=True, rtol=1e-9,
        atol=1e-12, max_step=1e-4,
    )  # fmt: skip
    time = np.arange(round(-BEFORE * RATE), round(AFTER * RATE)) / RATE
    force = np.where(time > 0.0, foam(*way.sol(np.clip(time, 0.0, AFTER))), 0.0)
    values = np.column_stack([-force / MASS, force])  # at rest in free fall, as gravity acts on its seismic mass too
    values += np.random.default_rng(int(10 * speed)).standard_normal(values.shape) * np.array([2.0, 10.0])
    channels = Channel("head_az", "acceleration", "head", "z"), Channel("table_fz", "force", "table", "z")
    return Recording(Test("drop", channels, initial_velocity={"head": speed}), np.rint(time * 1e9).astype(int), values)


@pytest.fixture(scope="module")
def drops() -> list[Recording]:
    return [drop(speed) for speed in (2.0, 3.0)]


def test_gravity_is_a_force_that_the_sensor_does_not_show(drops):
    """As the README has it for a drop tower."""
    found = diagnose(structure(MODEL + FALLS), drops)
    assert found.verdict == "adequate", found.text
    fit = found.models[0].fit
    weight, less = (float(fit.theta[term.coefficient]) for term in fit.layout.terms)
    assert weight == pytest.approx(MASS * G, rel=0.1) and less == pytest.approx(-G, rel=0.1)


def test_without_it_a_model_is_not_adequate(drops):
    """Else the test above would say nothing."""
    assert diagnose(structure(MODEL), drops).verdict != "adequate"
