"""What varies with time as a rival of all effects: a car's front that gives way as time goes on, by scipy."""

from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from scipy.integrate import solve_ivp

from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.diagnosis.report.diagnosis import Diagnosis
from crash_estimator.core.diagnosis.selection.selection_path import SelectionPath
from crash_estimator.core.diagnosis.selection.time_varying import Varying
from crash_estimator.model_file import ModelFile
from crash_replay.recording import Channel, Recording, Test

MASS, STIFFNESS, FRICTION = 1000.0, 6e5, 3e4  # kg, N/m, N
RATE, BEFORE, AFTER = 10_000, 0.03, 0.12  # Hz, s, s
NOISE = 10.0  # m/s^2, 1 g

MODEL = f"""
name: front
bodies:
  car: {{mass: {MASS}, acceleration: car_ax}}
  barrier: {{fixed: true, force: barrier_fx}}
elements:
  front:
    between: [car, barrier]
    stiffness: {{estimate: true, initial: 300000.0, min: 0.0, shape: constant}}
    tension: none
"""


def tearing(time):
    return 1.0 - 0.6 * np.clip((time - 0.02) / 0.04, 0.0, 1.0)


def softening(time):
    return 0.3 + 0.7 * np.exp(-time / 0.04)


def lasting(time):
    return 1.0


def crash(speed: float, friction: float, course) -> Recording:
    """course: of the stiffness, over time in s."""

    def force(time, crush, rate):
        return np.where(crush > 0.0, course(time) * STIFFNESS * crush + friction * np.tanh(rate / 0.2), 0.0)

    def moves(time, state):
        return state[1], -force(time, *state) / MASS

    way = solve_ivp(moves, (0.0, AFTER), (0.0, speed), max_step=2e-4, rtol=1e-8, dense_output=True)
    time = np.arange(round(-BEFORE * RATE), round(AFTER * RATE)) / RATE
    at = np.clip(time, 0.0, AFTER)
    push = np.where(time > 0.0, force(at, *way.sol(at)), 0.0)
    values = np.column_stack([-push / MASS, push])
    values += np.random.default_rng(int(speed)).standard_normal(values.shape) * np.array([NOISE, MASS * NOISE])
    channels = Channel("car_ax", "acceleration", "car", "x"), Channel("barrier_fx", "force", "barrier", "x")
    test = Test(f"at {speed:g} m/s", channels, initial_velocity={"car": speed})
    return Recording(test, np.rint(time * 1e9).astype(int), values)


def told(friction: float, course) -> Diagnosis:
    structure = ModelFile.model_validate(yaml.safe_load(MODEL)).structure()
    return diagnose(structure, [crash(speed, friction, course) for speed in (9.0, 13.0)])


def test_a_part_that_tears_is_no_effect_of_the_vocabulary():
    """Nothing more is looked for, as no candidate comes near."""
    found = told(0.0, tearing)
    assert (found.verdict, found.steps) == ("unexplained", ())
    said = "no candidate explains what is left as well as the stiffness of front that varies with time"
    assert said in found.text and "with 100% of the misfit" in found.text


def test_what_follows_a_part_that_softens_nearly_as_well_is_not_named():
    """A Maxwell element relaxes, too: it explains 99 % of the misfit."""
    found = told(0.0, softening)
    assert found.verdict == "unexplained" and found.steps[0].effect == "maxwell_element"
    assert "no better than the stiffness of front that varies with time" in found.text


def test_an_effect_is_likelier_than_a_stiffness_that_varies():
    found = told(FRICTION, lasting)
    assert (found.verdict, [step.effect for step in found.steps]) == ("effect_missing", ["coulomb_friction"])
    assert found.steps[0].coefficient == pytest.approx(FRICTION, rel=0.05)


@pytest.mark.parametrize(("explained", "candidates", "much_less"), [
    (0.96, (800.0,), True),  # it leaves 100
    (0.96, (800.0, 390.0), False),  # it takes less than three quarters of that away
    (0.94, (5000.0,), False),  # of the misfit
    (0.96, (), True),
    (0.96, (450.0,), False),  # a fit that is so near would be gone on with
])  # fmt: skip
def test_it_leaves_much_less_than_each_candidate(explained, candidates, much_less):
    records = [SimpleNamespace(bins=500, measured=np.zeros((1, 2)))]
    fit = SimpleNamespace(cost=1100.0, problem=SimpleNamespace(records=records))
    fits = [SimpleNamespace(cost=1000.0 + left) for left in candidates]
    assert Varying("a force on car", fit, explained).leaves_much_less(fits) == much_less


@pytest.mark.parametrize(("mean_square", "evidence", "cost", "rival"), [
    (1.0, 98.0, 1000.0, False),
    (1.0, 100.0, 1000.0, True),  # within six nats of it
    (1.9, 100.0, 1000.0, True),
    (2.0, 120.0, 1700.0, False),  # where much more than noise is left, that says little
    (2.0, 120.0, 1100.0, True),  # of 1000 more it leaves a tenth
])  # fmt: skip
def test_what_was_found_must_be_likelier_or_leave_about_as_little(mean_square, evidence, cost, rival):
    found = SimpleNamespace(evidence=105.0, cost=2000.0)
    records = [SimpleNamespace(bins=500, measured=np.zeros((1, 2)))]
    fit = SimpleNamespace(evidence=evidence, cost=cost, problem=SimpleNamespace(records=records))
    varying = Varying("a force on car", fit, 0.96)
    final = SimpleNamespace(residuals=SimpleNamespace(mean_square=mean_square))
    path = SelectionPath(None, [], final, found, records, 36, varying=varying)
    assert path.rival_in_time == (varying if rival else None)


def test_nothing_is_a_rival_where_nothing_was_fitted():
    assert SelectionPath(None, [], None, SimpleNamespace(evidence=0.0), (), 36).rival_in_time is None
