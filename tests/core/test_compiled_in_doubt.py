"""The compiled recursion against the readable one where the motion itself is in doubt, on a few samples."""

from dataclasses import replace

import pytest
from test_compiled_in_short import CASES, METHODS, assert_forms_agree, sparse

from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.model_file import load_model


@pytest.mark.parametrize("name, model", CASES)
@pytest.mark.parametrize("method", METHODS)
def test_both_forms_agree_where_initial_velocities_are_in_doubt(name, model, method):
    """Of two bodies that touch by unlike ones."""
    structure = load_model(model)
    bodies = tuple(
        body if body.fixed else replace(body, velocity_std=0.3 / (1 + k)) for k, body in enumerate(structure.bodies)
    )
    recording = sparse(name)
    found = assert_forms_agree(replace(structure, bodies=bodies), recording, method, **METHODS[method])
    certain = run(make_estimator(structure, recording.test, method, **METHODS[method]), recording.samples())
    assert (found[-1].std >= certain[-1].std).any()
