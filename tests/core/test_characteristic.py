"""The law of an element as its estimates have it: what is drawn, and what a free run goes by."""

from dataclasses import replace

import numpy as np
import pytest
from helpers_estimation import ESTIMATED, oscillator, oscillator_recording
from numpy.testing import assert_allclose, assert_array_equal

from crash_estimator.core.characteristic import _unloading, characteristics
from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.structure import Coefficient
from crash_replay.recording import Recording


@pytest.mark.parametrize("tension", [True, False])
def test_a_constant_stiffness_is_a_line_over_the_crush_it_was_found_on(tension):
    """As far to the side of tension, where a contact carries nothing; the damper beside it is no part of it."""
    recording = oscillator_recording(stiffness=2.0e4, damping=50.0)
    structure = oscillator(
        replace(ESTIMATED, shape="constant"), Coefficient(0.0, estimated=True, std=100.0), tension=tension
    )
    estimator = make_estimator(structure, recording.test, "kalman")
    estimates = list(run(estimator, recording.samples()))
    (found,) = characteristics(structure, estimator.description, estimates)
    stiffness = estimates[-1].parameters[estimator.description.parameters.index("spring.stiffness")]
    reach = np.abs(recording.column("travel")[recording.time_ns >= 0]).max()
    assert_allclose(found.crush, [-reach, 0.0, reach])
    assert_allclose(found.force, [-stiffness * reach if tension else 0.0, 0.0, stiffness * reach])
    if tension:
        assert_allclose([stiffness, found.damping], [2.0e4, 50.0], rtol=0.05)


def test_an_element_that_was_never_crushed_has_no_force_over_a_meter():
    moving = oscillator_recording(n=30)
    recording = Recording(moving.test, moving.time_ns, np.zeros_like(moving.values))
    estimator = make_estimator(oscillator(), recording.test, "kalman", compiled=False)
    (found,) = characteristics(oscillator(), estimator.description, run(estimator, recording.samples()))
    assert_array_equal(found.crush, [0.0, 1.0])
    assert_array_equal(found.force, [0.0, 0.0])


@pytest.mark.parametrize(("known", "estimated"), [(4e6, True), (4e6, False), (None, False)])
def test_an_unloading_line_that_is_known_or_of_a_known_spring_is_not_sought(known, estimated):
    """Though the force comes back on a line ten times as steep as it went up."""
    element = replace(oscillator().elements[0], unloading=known, stiffness=Coefficient(1e5, estimated=estimated))
    crush = np.concatenate([np.linspace(0.0, 0.1, 100), np.linspace(0.099, 0.091, 20)])
    force = np.where(np.arange(120) < 100, 1e5 * crush, 1e4 - 1e6 * (0.1 - crush))
    assert _unloading(element, crush, force) == known
    assert _unloading(replace(element, unloading=None, stiffness=Coefficient(1e5, True)), crush, force) > 5e5
