"""Gauss-Newton over a record until it settles."""

from dataclasses import replace

import numpy as np
from helpers_estimation import oscillator, oscillator_recording
from test_gauss_newton import BOTH, coloured

from crash_estimator.cli.estimate import _parser
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.passes import MOST_PASSES, SETTLED, most_passes, repeats, settle

SETTINGS = dict(p=1, q=1, forgetting=1.0, noise_memory=1e3)


def record(seed):
    return coloured(oscillator_recording(n=200, pre=0), [-0.8], [0.3], sd=3.0, seed=seed)


def maker(recording):
    structure = oscillator(**BOTH)
    structure = replace(structure, bodies=(replace(structure.bodies[0], noise=3.0), structure.bodies[1]))
    return lambda start: make_estimator(structure, recording.test, "gauss_newton", start=start, **SETTINGS)


def test_it_settles_and_a_further_pass_changes_nothing():
    recording = record(0)
    passes = settle(maker(recording), recording)
    assert passes.settled and 1 <= len(passes.moved) < MOST_PASSES
    further = settle(maker(recording), recording, len(passes.moved) + 2)
    assert further.moved == passes.moved  # it stops where it has settled
    assert "settled" in passes.text and f"{len(passes.moved) + 1} passes" in passes.text


def test_settled_is_no_farther_from_the_truth_than_one_pass():
    """The mean square of 8 errors in K: one pass counts its first samples little, and with a wrong noise model."""
    one, settled = [], []
    for seed in range(8):
        recording = record(seed)
        for most, errors in ((1, one), (MOST_PASSES, settled)):
            last = settle(maker(recording), recording, most).estimates[-1]
            errors.append(last.parameters[0] / 2.0e4 - 1.0)
    assert np.mean(np.square(settled)) < np.mean(np.square(one))


def test_one_pass_is_the_recursion_itself():
    recording = record(1)
    passes = settle(maker(recording), recording, 1)
    assert passes.moved == () and not passes.settled
    assert passes.text.startswith("one pass")


def test_only_a_noise_model_that_is_to_be_found_is_repeated():
    test = record(0).test
    assert repeats(make_estimator(oscillator(**BOTH), test, "gauss_newton"))
    assert not repeats(make_estimator(oscillator(**BOTH), test, "gauss_newton", p=0, q=0))
    assert not repeats(make_estimator(oscillator(**BOTH), test, "rls"))
    assert SETTLED < 1.0


def test_the_printed_recursion_goes_over_a_record_once():
    given = [_parser().parse_args(["x", "--model", "m", *more]).passes for more in ([], ["--passes", "3"])]
    assert [[most_passes(n, preset) for n in given] for preset in ("ours", "thesis")] == [[MOST_PASSES, 3], [1, 3]]
