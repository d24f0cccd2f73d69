"""The thesis's experiments: the code behind docs/thesis.md and the limits that its tables must keep."""

import numpy as np
import pytest

from crash_estimator.core.structure import ModelError
from crash_estimator.thesis import cases
from crash_estimator.thesis.experiments import FRONTAL, SIDE, alike, dummy, noise_orders, ratios
from crash_estimator.thesis.page import write_page


@pytest.mark.parametrize(("case", "settings"), [("frontal", FRONTAL), ("side", SIDE)])
def test_mrls_leaves_the_noise_and_rls_more(case, settings):
    """Median ratio of error to noise variance: MRLS 0.65 to 1.15 in every equation, RLS 1.3 times it in two."""
    found = ratios(getattr(cases, case)(shares=cases.EQUAL), case, settings, seeds=14, as_printed=False)
    mrls, rls = found.median("mrls"), found.median("rls")
    assert ((mrls > 0.65) & (mrls < 1.15)).all(), mrls
    assert (rls > 1.3 * mrls).sum() >= 2, rls / mrls


@pytest.mark.parametrize(("case", "settings"), [("frontal", FRONTAL), ("side", SIDE)])
def test_mrls_beats_rls_by_more_than_in_the_thesis_at_its_own_noise(case, settings):
    """With the six shares of tables 5.1 and 5.2, as we have it and as printed, in every equation.

    In the thesis RLS leaves 1.05 to 3.4 times what MRLS leaves; where that is near 1 we ask for twice.
    """
    found = ratios(getattr(cases, case)(), case, settings, seeds=4)
    for kind in ("", " as printed"):
        assert (found.median(f"rls{kind}") > 2.0 * found.median(f"mrls{kind}")).all()
    assert (np.abs(np.median(found.means["mrls"], axis=0)) < np.abs(np.median(found.means["rls"], axis=0))).all()


@pytest.mark.parametrize("offsets", [False, True])
def test_the_dummy_leaves_the_noise_and_no_more(offsets):
    """Table 6.1: diagonal 0.8 to 1.25, off it under 0.2 of the diagonal; as in the thesis, and as we do by default."""
    ratio = np.median(dummy(seeds=9, offsets=offsets).ratio, axis=0)
    diagonal = np.diag(ratio)
    assert ((diagonal > 0.8) & (diagonal < 1.25)).all(), ratio
    assert np.abs(ratio - np.diag(diagonal)).max() < 0.2 * diagonal.min()


def test_a_noise_model_leaves_the_stiffness_and_takes_most_of_the_autocorrelation():
    """4.5.1 with its sine, the first curve: K/M with p,q = 0,0 and 1,2 within their sigmas.

    Q, and the lags beyond the limit, fall.

    That 1,2 leaves no more than white noise cannot be asked: a sine is no ARMA(1,2), see docs/thesis.md.
    """
    found = noise_orders("#1", seeds=9)
    assert np.median(found.apart) < 1.0 and np.median(found.within) > 0.85
    assert np.median(found.rms[1, 2]) < np.median(found.rms[0, 0])
    assert not found.uncorrelated[0, 0].any()
    assert np.median(found.q[1, 2]) < 0.2 * np.median(found.q[0, 0])
    assert np.median(found.inside[1, 2]) > 0.8 > 0.6 > np.median(found.inside[0, 0])


def test_noise_of_the_model_s_kind_is_left_white():
    """4.12, e is ARMA(1,2), the second curve: K/M within their sigmas, white at 95 % with 1,2 and never with 0,0.

    A white residual passes at 95 % in 95 % of repetitions; of 14, fewer than 12 would be so in 3 % of the cases.
    """
    found = noise_orders("#2", seeds=14, noise=cases.arma)
    assert np.median(found.apart) < 1.0 and np.median(found.within) > 0.85
    assert np.mean(found.uncorrelated[1, 2]) >= 0.85 and not found.uncorrelated[0, 0].any()


def test_two_tests_of_one_car_have_one_noise_model():
    found = alike(seeds=1)
    assert not any(d.differs(0.95) for pair in found.same for d in pair)
    assert all(d.differs(0.99) for pair in found.other for d in pair)


def test_fewer_than_twenty_repetitions_are_refused(tmp_path):
    with pytest.raises(ModelError, match="fewer than 20 seeds"):
        write_page(tmp_path, seeds=5)
