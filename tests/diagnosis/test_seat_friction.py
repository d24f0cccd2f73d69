"""An occupant who slides on a seat: friction that acts also where the belt beside it carries nothing."""

from dataclasses import replace

import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.applied import applied
from crash_estimator.core.effects.targets import check_effects
from crash_estimator.core.fold import run
from crash_estimator.core.free_run import free_run
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.structure import EffectSpec, ModelError, Structure
from crash_estimator.model_file import ModelFile
from crash_replay.recording import Channel, Recording, Test

MASS, BELT, FRICTION, SLIPS_AT = 32.0, 9e4, 900.0, 0.15  # kg, N/m, N, m/s
RATE, BEFORE, AFTER = 5_000, 0.03, 0.12  # Hz, s, s
NOISE = 3.0  # m/s^2

MODEL = """
name: sled
bodies:
  sled: {motion: sled_ax}
  pelvis: {mass: 32.0, acceleration: pelvis_ax}
elements:
  lap:
    between: [pelvis, sled]
    stiffness: {estimate: true, initial: 60000.0, min: 0.0, shape: constant}
    tension: none
"""


def structure() -> Structure:
    return ModelFile.model_validate(yaml.safe_load(MODEL)).structure()


def sled_test(peak: float) -> Recording:
    """A sled that is braked by a half-sine of `peak` m/s^2; the occupant moves on, is held, and comes back."""
    length = 0.08

    def pulse(t):
        return np.where((t > 0.0) & (t < length), -peak * np.sin(np.pi * t / length), 0.0)

    def push(x, v):
        return -BELT * np.maximum(x, 0.0) - FRICTION * np.tanh(v / SLIPS_AT)

    way = solve_ivp(
        lambda t, y: (y[1], float(push(*y)) / MASS - float(pulse(t))), (0.0, AFTER), (0.0, 0.0), dense_output=True,
        rtol=1e-9, atol=1e-12, max_step=2e-4,
    )  # fmt: skip
    time = np.arange(round(-BEFORE * RATE), round(AFTER * RATE)) / RATE
    felt = np.where(time > 0.0, push(*way.sol(np.clip(time, 0.0, AFTER))) / MASS, 0.0)
    values = np.column_stack([pulse(time), felt])
    values += np.random.default_rng(int(peak)).normal(scale=NOISE, size=values.shape)
    channels = Channel("sled_ax", "acceleration", "sled", "x"), Channel("pelvis_ax", "acceleration", "pelvis", "x")
    stands = {"sled": 0.0, "pelvis": 0.0}
    return Recording(Test(f"sled {peak:g}", channels, initial_velocity=stands), np.rint(time * 1e9).astype(int), values)


@pytest.fixture(scope="module")
def recordings() -> list[Recording]:
    return [sled_test(peak) for peak in (150.0, 240.0)]


def test_it_is_named_with_the_force_that_it_has(recordings):
    """A friction in the belt and a force on the pelvis that rises were told, and left more than noise."""
    found = diagnose(structure(), recordings)
    (step,) = found.steps
    assert (found.verdict, found.complete, step.name) == ("effect_missing", True, "coulomb_friction (sliding) on lap")
    assert abs(step.coefficient - FRICTION) < 4.0 * step.std < 0.1 * FRICTION


def test_estimators_and_free_runs_follow_it(recordings):
    """Without it the stiffness has to take it, and the simulated pelvis goes on without being held."""
    slides = EffectSpec("coulomb_friction", "lap", FRICTION, {"speed": SLIPS_AT}, variant="sliding")
    off = {}
    for effects in ((), (slides,)):
        model = replace(structure(), effects=effects)
        estimator = make_estimator(model, recordings[1].test, "constrained_kalman")
        estimates = run(estimator, recordings[1].samples())
        free = free_run(applied(model, recordings[1].test), estimator.description, estimates)
        off[len(effects)] = np.sqrt(np.nanmean((free.predicted - free.measured) ** 2))
    assert estimates[-1].parameters[0] == pytest.approx(BELT, rel=0.02)
    assert off[1] < 1.3 * NOISE < 0.3 * off[0]


def test_an_estimator_finds_it_sample_by_sample(recordings):
    model = replace(
        structure(), effects=(EffectSpec("coulomb_friction", "lap", None, {"speed": SLIPS_AT}, variant="sliding"),)
    )
    estimator = make_estimator(model, recordings[1].test, "constrained_kalman")
    (at,) = (k for k, name in enumerate(estimator.description.parameters) if "coulomb_friction" in name)
    last = run(estimator, recordings[1].samples())[-1]
    assert_allclose(last.parameters[at], FRICTION, atol=4.0 * np.sqrt(last.covariance[at, at]))


def test_an_element_that_does_not_come_apart_has_no_such_form():
    (lap,) = structure().elements
    held = replace(structure(), elements=(replace(lap, tension=True),))
    given = replace(held, effects=(EffectSpec("coulomb_friction", "lap", variant="sliding"),))
    with pytest.raises(ModelError, match="coulomb_friction on lap: form 'sliding' is of an element that comes apart"):
        check_effects(given, EFFECTS)
