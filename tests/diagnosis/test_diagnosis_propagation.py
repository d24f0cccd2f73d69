"""The compiled passes of the fit: one agrees with the other, and a spring with its curve read off."""

import numpy as np
import pytest
from helpers_diagnosis import hidden_case
from numpy.testing import assert_allclose

from crash_estimator.core.diagnosis.mechanics.linearization import linearise
from crash_estimator.core.diagnosis.mechanics.link_force import link_force
from crash_estimator.core.diagnosis.observation.grid import binned
from crash_estimator.core.diagnosis.observation.record import observe
from crash_estimator.core.diagnosis.output_error.gauss_newton import fit
from crash_estimator.core.diagnosis.output_error.problem import make_problem
from crash_estimator.core.diagnosis.output_error.sensitivity_equations import propagate, respond
from crash_estimator.core.diagnosis.parameterization.free_curve import value
from crash_estimator.core.diagnosis.parameterization.magnitudes import measure_magnitudes


def fitted(structure: str):
    _, model, recording = hidden_case(structure, "", 8201)
    records = [observe(model, recording)]
    problem = make_problem(measure_magnitudes(model, records), records, ())
    return problem.layout, records[0], fit(problem)


@pytest.mark.parametrize("structure", ["frontal", "side", "dummy"])
def test_a_small_change_of_the_parameters_is_felt_as_the_sum_of_their_columns(structure):
    layout, record, found = fitted(structure)
    equations = linearise(found.problem.experiments[0], found.theta, found.trajectories[0])
    out = np.zeros((record.bins, len(layout.outputs), 1 + len(equations.columns)))
    propagate(equations.linear, equations.sampling, out)
    std = np.sqrt(np.diagonal(found.covariance))[equations.columns]
    change = np.append(1.0, std * np.random.default_rng(0).normal(size=len(std)))
    accelerations = respond(equations.linear, change)
    free = [q for q, output in enumerate(layout.outputs) if not output.fixed]
    shown = accelerations[:, [layout.outputs[q].body for q in free]]
    expected = binned(record.bin, equations.sampling.weight[:, free] * shown, record.bins)
    assert_allclose((out @ change)[:, free], expected, atol=1e-9 * np.abs(expected).max())


def test_a_curve_is_read_where_the_crush_is_whichever_way_it_goes():
    layout, record, found = fitted("dummy")
    curved = [link for link in layout.links if link.curve is not None]
    assert curved
    for link in curved:
        crush = link.curve.knots[-1] * (1.2 * np.abs(np.sin(25.0 * record.time)) - 0.05)
        rate, steps = np.gradient(crush, record.time), np.full_like(crush, record.step)
        force = link_force(link, found.theta, record.time, steps, crush, rate).force
        peak = np.maximum(np.maximum.accumulate(crush), 0.0)
        at, line = (crush, 0.0) if link.unloading is None else (peak, link.unloading * (peak - crush))
        read = value(link.curve, found.theta, at) - line
        carries = link.tension | ((crush > 0.0) & ((read > 0.0) | (crush >= peak)))
        damping = found.theta[link.damping] if link.damping is not None else link.known_damping
        assert damping == 0.0 and carries.any()
        assert_allclose(force, np.where(carries, read, 0.0), rtol=1e-12, atol=1e-9 * np.abs(read).max())
