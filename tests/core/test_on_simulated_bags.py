"""What the estimators find on the bundled recordings, against the simulator's truth."""

from functools import cache

import numpy as np
import pytest
from helpers_paths import BAGS

from crash_estimator.core.errors import equation_errors
from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.model_file import load_model
from crash_replay.bag import read_bag
from crash_replay.synthetic.recordings import BUNDLED_SEED, SCENARIOS

MODELS = {
    "frontal_single": "frontal_single",
    "frontal_engine_cab": "frontal_engine_cab",
    "side_mdb_door_car": "side_mdb_door_car",
    "side_dummy_padded": "side_dummy",
    "side_dummy_unpadded": "side_dummy",
    "impactor_single": "impactor_single",
}
CARRIES = 1000.0  # N: peak forces are held against the truth above this


@cache
def followed(name, method, model=None):
    """-> structure, estimator's description, estimates of the bundled bag, the simulator's truth."""
    recording = read_bag(BAGS / f"{name}.mcap")
    structure = load_model(model or MODELS[name])
    estimator = make_estimator(structure, recording.test, method)
    return structure, estimator.description, run(estimator, recording.samples()), SCENARIOS[name](BUNDLED_SEED)[1]


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("method", ["rls", "mrls", "constrained_kalman"])
def test_stiffness_is_never_negative(name, method):
    _, description, estimates, _ = followed(name, method)
    stiffnesses = [k for k, parameter in enumerate(description.parameters) if parameter.endswith(".stiffness")]
    values = np.array([estimate.parameters[stiffnesses] for estimate in estimates])
    assert np.isfinite(values).all() and values.min() >= 0.0


@pytest.mark.parametrize("name", MODELS)
def test_peak_forces_are_within_five_percent(name):
    structure, _, estimates, truth = followed(name, "constrained_kalman")
    forces = np.array([estimate.force for estimate in estimates if estimate.time_ns >= 0])
    for k, element in enumerate(structure.elements):
        peak = truth.elements[element.name].force.max()
        if peak > CARRIES:
            error = forces[:, k].max() / peak - 1.0
            said = f"{forces[:, k].max() / 1e3:.2f} kN, truth {peak / 1e3:.2f} kN, {error:+.1%}"
            print(f"{name} {element.name}: peak force {said}")
            assert abs(error) < 0.05, element.name


@pytest.mark.parametrize("name", ["side_dummy_padded", "side_dummy_unpadded"])
def test_the_dummy_s_stiffness_lies_within_three_sigma(name):
    structure, description, estimates, truth = followed(name, "constrained_kalman")
    after = np.array([estimate.time_ns >= 0 for estimate in estimates])
    for element in structure.elements:
        known = truth.elements[element.name]
        loaded = after & (known.state == "loading") & (known.crush > 0.010)
        p = description.parameters.index(f"{element.name}.stiffness")
        value = np.array([estimate.parameters[p] for estimate in estimates])
        std = np.array([estimate.std[p] for estimate in estimates])
        inside = np.mean(np.abs(value - known.stiffness)[loaded] <= 3.0 * std[loaded]) if loaded.any() else None
        if inside is not None:
            print(f"{name} {element.name}: inside 3 sigma at {inside:.1%} of {loaded.sum()} loaded samples")
            assert inside >= 0.90, element.name


def test_mrls_follows_abrupt_changes_closer_than_rls():
    """Variance of error per equation, residual after the update (tables 5.1 and 5.2)."""
    variances = {}
    for method in ("rls", "mrls"):
        _, description, estimates, truth = followed("frontal_abrupt", method, BAGS / "frontal_abrupt.model.yaml")
        variances[method] = [row.error_variance for row in equation_errors(description, estimates)]
    noises = [truth.channels[name].noise ** 2 for name in ("car_ax", "engine_ax", "barrier_fx")]
    print("\nerror variance over noise variance, frontal_abrupt\nequation      RLS     MRLS")
    for name, rls, mrls, noise in zip(description.equations, variances["rls"], variances["mrls"], noises):
        print(f"{name:8s} {rls / noise:8.2f} {mrls / noise:8.2f}")
    assert sum(m < r for m, r in zip(variances["mrls"], variances["rls"])) >= 2
