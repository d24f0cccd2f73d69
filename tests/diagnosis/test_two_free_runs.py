"""The diagnosis's simulation against the estimators' free run, which shares no code with it."""

from dataclasses import replace

import numpy as np
import pytest
from test_diagnosis_oracles import (
    CUBIC,
    EVERY_EFFECT,
    ON_A_LINE,
    on_a_line,
    outputs,
    problem_of,
    recorded,
    shown,
    structure,
)

from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.applied import applied
from crash_estimator.core.fold import run
from crash_estimator.core.free_run import free_run
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.structure import Structure
from crash_replay.recording import Recording


@pytest.fixture(scope="module")
def recording() -> Recording:
    return recorded()


IN_BOTH = [None, *(effect for effect in EVERY_EFFECT if not EFFECTS[effect.type].distorts)]
PULLS_OR_NOT = [(e, pulls) for pulls in (True, False) for e in IN_BOTH if pulls or not e or e.target == "foam"]
"""Effects in both free runs; with a damper of the foam's that does not pull, those beside whose force it counts."""


@pytest.mark.parametrize("effect, pulls", PULLS_OR_NOT, ids=lambda it: shown(it) or str(it))
def test_the_two_free_runs_agree(effect, pulls, recording):
    """The diagnosis's simulation and the estimators' free run, of one model with the same constants."""
    model = structure(*([effect] if effect else []))
    foam, mount = model.elements
    assert_free_runs_agree(replace(model, elements=(replace(foam, damper_pulls=pulls), mount)), recording)


@pytest.mark.parametrize("effect, what", ON_A_LINE, ids=shown)
def test_so_they_do_where_the_spring_is_spent(effect, what, recording):
    assert_free_runs_agree(on_a_line(effect, what), recording)


def test_what_acts_where_the_spring_is_spent_makes_a_difference(recording):
    """Else the two tests above would say nothing."""
    found = [outputs(*problem_of(on_a_line(CUBIC, what), recording)) for what in ("nothing", "springs", "all")]
    for one, other in zip(found, found[1:], strict=False):
        assert np.abs(one - other).max() > 0.02 * np.abs(one).max()


def assert_free_runs_agree(model: Structure, recording: Recording) -> None:
    """At every other sample, of each of which the free run makes one step; what plays between two stops takes all."""
    every = 1 if any(effect.variant == "play" for effect in model.effects) else 2
    recording = replace(recording, time_ns=recording.time_ns[::every], values=recording.values[::every])
    one, estimator = outputs(*problem_of(model, recording)), make_estimator(model, recording.test, "rls")
    other = free_run(applied(model, recording.test), estimator.description, run(estimator, recording.samples()))
    # at the impact itself, where forces jump, one is on this side of it and the other on that
    error = np.sqrt(np.mean((one - other.predicted)[2:] ** 2, axis=0))
    assert np.all(error < 0.002 * np.abs(one).max(axis=0))
