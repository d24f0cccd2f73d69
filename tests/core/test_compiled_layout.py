"""The compiled recursion's one array, its plan and its matrices: what is where, and that it comes back."""

import numpy as np
import pytest
from helpers_estimation import plain
from helpers_paths import BAGS
from numpy.testing import assert_allclose, assert_array_equal

from crash_estimator.core.compiled.layout import ROW, STATE, shapes
from crash_estimator.core.compiled.linear import invert
from crash_estimator.core.compiled.plan import MethodPlan, flat, make_method_plan
from crash_estimator.core.compiled.views import method_of, plan_views, row_views, size_of, state_views
from crash_estimator.core.methods import make_estimator
from crash_estimator.model_file import load_model
from crash_replay.bag import read_bag


def compiled_form(name, method):
    """Of a ready model and its simulated test."""
    return make_estimator(load_model(name), read_bag(BAGS / f"{name}.mcap").test, method, compiled=True)


def test_the_views_are_those_of_the_layout():
    estimator = compiled_form("frontal_single", "mrls")
    for table, make in ((STATE, state_views), (ROW, row_views)):
        given = shapes(table, estimator.size)
        flat = np.arange(sum(int(np.prod(shape)) for shape in given.values()), dtype=float)
        parts = make(flat, estimator.size)
        assert parts._fields == tuple(given)
        assert [part.shape for part in parts] == list(given.values())
        assert_array_equal(np.concatenate([part.ravel() for part in parts]), flat)


@pytest.mark.parametrize("method", ["mrls", "constrained_kalman"])
def test_a_plan_comes_back_from_its_two_arrays(method):
    estimator = compiled_form("frontal_engine_cab", method)
    settings = make_method_plan(estimator.method)
    whole, others = flat(estimator.size, settings, estimator.plan)
    assert size_of(whole) == estimator.size
    assert_array_equal(method_of(others), settings)
    plan = plan_views(whole[len(estimator.size) :], others[len(settings) :], estimator.size)
    for name, found, given in zip(estimator.plan._fields, plan, estimator.plan, strict=True):
        assert_array_equal(found, given, err_msg=name)


def test_each_setting_of_a_method_comes_back_in_its_place():
    settings = MethodPlan(True, False, *np.arange(2.5, 8.0), 3, 8.5)
    assert plain(method_of)(np.array(settings, dtype=float)) == settings


def test_the_kept_part_of_a_matrix_is_inverted_and_a_singular_one_gives_no_number():
    rng = np.random.default_rng(0)
    half = rng.standard_normal((5, 5)) * [1e5, 1.0, 1e-3, 10.0, 1.0]  # units as far apart as N/m and N s/m
    matrix, keep, found = half.T @ half, np.array([1.0, 0.0, 1.0, 1.0, 1.0]), half.T @ half
    invert(found, keep, np.empty(5))
    kept = np.flatnonzero(keep)
    inner = np.ix_(kept, kept)
    assert_allclose(found[inner] @ matrix[inner], np.eye(4), atol=1e-6)
    assert not found[1].any() and not found[:, 1].any()
    with np.errstate(all="ignore"):  # of which compiled code says nothing
        found[:] = 0.0
        invert(found, keep, np.empty(5))
    assert not np.isfinite(found[inner]).any()
