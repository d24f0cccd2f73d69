"""Known errors of channels are taken out of the samples before an estimator sees them."""

from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
from numpy.testing import assert_allclose

from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.channels import ChannelErrors, Corrected, Offset
from crash_replay.recording import Sample

STEP = 100_000  # ns


class Seen(NamedTuple):
    """What the estimator inside is given."""

    time_ns: int
    given_ns: int
    values: np.ndarray


def given(gain, delay, offsets=()):
    """-> what it sees of 40 samples of two channels, sin and 2 cos as they truly are, recorded with these errors."""
    inner = SimpleNamespace(
        description=None, init=lambda: 0,
        step=lambda state, sample: (state, Seen(sample.time_ns, sample.time_ns, sample.values)),
    )  # fmt: skip
    errors = ChannelErrors(np.array(gain), np.array(delay), tuple(offsets))
    corrected, found = Corrected(inner, errors), []
    state = corrected.init()
    for k in range(-5, 35):
        then = k * STEP - np.array(delay) * 1e9
        offset = errors.offset(k * STEP * 1e-9) if k >= 0 else 0.0
        values = (1.0 + errors.gain) * true(then) + offset
        state, seen = corrected.step(state, Sample(k + 5, k * STEP, values))
        found.append(seen)
    return found, state


def true(time_ns):
    phase = np.broadcast_to(np.asarray(time_ns, dtype=float), 2) * 1e-6
    return np.array([np.sin(phase[0]), 2.0 * np.cos(phase[1])])


def test_a_late_channel_and_one_that_is_not_are_of_the_same_instant():
    late = 3 * STEP
    found, state = given([0.0, 0.0], [late * 1e-9, 0.0])
    for k, seen in enumerate(found[8:], 3):
        assert seen.given_ns == k * STEP - late, "the estimator is given the instant that all know of"
        assert seen.time_ns == k * STEP, "which is said with the sample"
        assert_allclose(seen.values, true(k * STEP - late), atol=1e-12)
    assert len(state.recent) <= 5, "no more is kept than the delay reaches back"


def test_without_a_delay_each_sample_is_its_own_and_none_is_kept():
    found, state = given([0.1, -0.05], [0.0, 0.0])
    for k, seen in enumerate(found, -5):
        assert seen.given_ns == seen.time_ns == k * STEP
        assert_allclose(seen.values, true(k * STEP), atol=1e-12)
    assert state.recent == ()


@pytest.mark.parametrize("form", ["", "drift"])
def test_an_offset_counts_from_time_zero_on(form):
    found, _ = given([0.0, 0.1], [0.0, 0.0], [Offset(1, EFFECTS["channel_offset"], form, 4.0)])
    for k, seen in enumerate(found, -5):
        assert_allclose(seen.values, true(k * STEP), atol=1e-12)


def test_channels_that_are_late_by_different_times_are_of_the_same_instant():
    late = np.array([6, 2]) * STEP
    found, _ = given([0.0, 0.0], late * 1e-9)
    for k, seen in enumerate(found[8:], 3):
        assert seen.given_ns == k * STEP - late[0]
        if seen.given_ns >= 0:  # what was recorded before the first sample is not known
            assert_allclose(seen.values, true(k * STEP - late[0]), atol=1e-12)
