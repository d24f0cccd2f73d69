"""A head that falls on foam: its accelerometer shows how fast it falls less than freely, not how its speed changes."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from scipy.integrate import solve_ivp

from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.applied import applied
from crash_estimator.core.fold import run
from crash_estimator.core.free_run import free_run
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.structure import ModelError, Structure
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
- {type: gravity, body: head, coefficient: 9.80665}
"""
IN_TWO_PARTS = f"""
effects:
- {{type: constant_force, body: head, coefficient: {MASS * G}}}
- {{type: channel_offset, channel: head_az, coefficient: {-G}}}
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


def test_a_model_without_gravity_is_told_that_it_lacks_it(drops):
    """It was told that the pad unloads along a line: a search does not find a force and a zero together."""
    found = diagnose(structure(MODEL), drops)
    (step,) = found.steps
    assert (found.verdict, found.complete, step.name) == ("effect_missing", True, "gravity on head"), found.text
    assert step.coefficient == pytest.approx(G, rel=0.02) and abs(step.coefficient - G) < 4.0 * step.std


def test_with_gravity_nothing_is_missing(drops):
    found = diagnose(structure(MODEL + FALLS.replace(", coefficient: 9.80665", "")), drops)
    assert found.verdict == "adequate", found.text
    (term,) = found.models[0].fit.layout.terms
    zero_told_to = 2.0 / np.sqrt(2 * BEFORE * RATE)  # m/s^2: standard deviation, from both rests
    assert float(found.models[0].fit.theta[term.coefficient]) == pytest.approx(G, abs=4.0 * zero_told_to)


@pytest.mark.parametrize(("axis", "offered"), [("z", ["head"]), ("x", [])])
def test_it_is_looked_for_of_what_moves_up_or_down(drops, axis, offered):
    test = replace(drops[0].test, channels=tuple(replace(c, axis=axis) for c in drops[0].test.channels))
    magnitudes = SimpleNamespace(records=[SimpleNamespace(test=test)])
    found = EFFECTS["gravity"].candidates(structure(MODEL), magnitudes)
    assert [addition.target for addition in found] == offered


def test_estimators_and_free_runs_take_it_as_the_weight_and_what_the_sensor_does_not_show(drops):
    told = {}
    for name, text in {"one": FALLS, "two": IN_TWO_PARTS, "none": ""}.items():
        model = structure(MODEL + text)
        estimator = make_estimator(model, drops[1].test, "constrained_kalman")
        estimates = run(estimator, drops[1].samples())
        free = free_run(applied(model, drops[1].test), estimator.description, estimates)
        told[name] = [estimates[-1].parameters[:2], free.predicted, free.displacement]
    for one, two, none in zip(*told.values(), strict=True):
        assert one == pytest.approx(two, rel=1e-9) and np.abs(one - none).max() > 1e-3 * np.abs(one).max()


def test_an_estimator_asks_for_its_coefficient(drops):
    with pytest.raises(ModelError, match="gravity on head needs its coefficient, in m/s"):
        make_estimator(structure(MODEL + FALLS.replace(", coefficient: 9.80665", "")), drops[0].test, "rls")
