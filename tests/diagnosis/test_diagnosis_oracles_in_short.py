"""The oracles of the diagnosis on a short record of one effect of each kind: quick also where nothing is compiled."""

import numpy as np
import pytest
from test_diagnosis_oracles import (
    EVERY_EFFECT,
    NEAR,
    ON_A_LINE,
    SPEED,
    assert_derivatives_agree,
    motion,
    on_a_line,
    problem_of,
    shown,
    structure,
)

from crash_estimator.core.diagnosis.mechanics.linearization import linearise
from crash_estimator.core.diagnosis.mechanics.outputs import predicted
from crash_estimator.core.diagnosis.observation.grid import binned
from crash_estimator.core.diagnosis.output_error.normal_equations import equation_error
from crash_estimator.core.structure import EffectSpec
from crash_replay.recording import Channel, Recording, Test

RATE = 4000.0
KINDS = [effect for effect in EVERY_EFFECT if effect.type in (
    "viscous_damping", "hysteresis", "plastic_unloading", "load_path", "added_mass", "channel_gain",
)]  # fmt: skip


def short_record(rate: float, before: int, after: int, seed: int, speed: float) -> Recording:
    """Of the striker and the plate, with white noise: so many samples before the impact and from it on."""
    values = np.concatenate([np.zeros((before, 3)), motion(np.arange(after) / rate)[:, :3]])
    values += np.random.default_rng(seed).normal(size=values.shape) * np.array([2.0, 2.0, 50.0])
    channels = (
        Channel("striker_ax", "acceleration", "striker", "x"),
        Channel("plate_ax", "acceleration", "plate", "x"),
        Channel("wall_fx", "force", "wall", "x"),
    )
    time_ns = (np.arange(-before, after) * 1e9 / rate).astype(np.int64)
    return Recording(Test("striker", channels, initial_velocity={"striker": speed}), time_ns, values)


@pytest.fixture(scope="module")
def recording() -> Recording:
    """Until the striker is on its way back."""
    return short_record(RATE, 40, 260, seed=1, speed=SPEED)


BETWEEN_SAMPLES = EffectSpec("channel_delay", "plate_ax", 3.1e-4)


@pytest.mark.parametrize("effect", [*KINDS, BETWEEN_SAMPLES], ids=shown)
def test_the_derivatives_of_the_outputs_are_their_finite_differences(effect, recording):
    assert_derivatives_agree(structure(effect), recording, NEAR[effect.type])


@pytest.mark.parametrize("effect, what", ON_A_LINE[1::3], ids=shown)
def test_so_they_are_where_the_spring_is_spent(effect, what, recording):
    assert_derivatives_agree(on_a_line(effect, what), recording, NEAR[effect.type])


@pytest.mark.parametrize("effect", KINDS, ids=shown)
def test_along_a_given_motion_the_derivative_is_that_of_the_forces_alone(effect, recording):
    """Not even what an element remembers moves the bodies there: a motion that answered to that alone would run away.
    Of the coefficient, by finite differences of the forces along that motion."""
    problem, point = problem_of(structure(effect), recording)
    (experiment,), (term,) = problem.experiments, problem.layout.terms
    record, trajectory, step = experiment.record, point.trajectories[0], 1e-4 * point.theta[term.coefficient]
    moved = []
    for sign in (1.0, -1.0):
        theta = point.theta.copy()
        theta[term.coefficient] += sign * step
        moved.append(predicted(experiment, theta, linearise(experiment, theta, trajectory).rows, trajectory))
    weight = linearise(experiment, point.theta, trajectory).sampling.weight
    expected = binned(record.bin, weight * (moved[0] - moved[1]) / (2.0 * step), record.bins)
    found = equation_error(problem, point).matrix[term.coefficient, term.coefficient]
    assert found == pytest.approx((expected**2).sum(), rel=1e-3)
