"""In a rush the estimates go first: what is for who looks on comes after it, all of it and in its order."""

import numpy as np
import pytest
from helpers_estimation import oscillator, oscillator_recording

from crash_estimator.core.methods import make_estimator
from crash_estimator.following.columns import follow
from crash_estimator.following.follower import Follower
from crash_estimator.kept import Kept, Rows
from crash_estimator.nodes import later
from crash_estimator.nodes.later import HOLD, RUSH, Later
from crash_estimator.rush import LULL, PERIOD

OVER = LULL + 2.0 * PERIOD


class Stand:
    """A clock that the test turns, and what is published."""

    def __init__(self):
        self.now, self.taken, self.published = 0.0, True, []
        self.later = Later(lambda data: self.published.append(data), lambda: self.taken, lambda: self.now)

    def say(self, data: bytes, samples: int, seconds: float, size: int = 100) -> None:
        """Of so many samples that came within this time."""
        self.now += seconds
        self.later.put(lambda: data, size, self.later.count(samples))


@pytest.fixture
def stand() -> Stand:
    return Stand()


def in_a_rush(stand: Stand, messages: int, size: int = 100) -> list[bytes]:
    said = [b"%d" % k for k in range(messages)]
    for data in said:
        stand.say(data, int(3 * RUSH * PERIOD), 1.5 * PERIOD, size)
    return said


def test_at_the_pace_of_any_test_all_is_published_at_once(stand):
    for k in range(20):
        stand.say(b"%d" % k, int(RUSH * PERIOD), 2.0 * PERIOD)
        assert stand.published[-1] == b"%d" % k


def test_what_comes_in_a_rush_is_published_when_it_is_over(stand):
    said = in_a_rush(stand, 5)
    stand.later.look()
    assert not stand.published
    stand.now += OVER
    stand.later.look()
    assert stand.published == said and not stand.later.held


def test_one_slow_period_is_not_the_end_of_a_rush(stand):
    said = in_a_rush(stand, 3)
    stand.say(b"slow", 1, 2.0 * PERIOD)
    stand.later.look()
    assert not stand.published
    said += [b"slow", *in_a_rush(stand, 2)]
    stand.later.look()
    assert not stand.published
    stand.now += OVER
    stand.later.look()
    assert stand.published == said


def test_what_comes_after_a_rush_comes_after_what_waits(stand):
    said = in_a_rush(stand, 3)
    stand.say(b"last", 1, OVER)
    assert not stand.published
    stand.later.look()
    assert stand.published == [*said, b"last"]


def test_no_faster_than_it_is_taken(stand, monkeypatch):
    in_a_rush(stand, 3)
    stand.now += OVER
    stand.taken = False
    monkeypatch.setattr(later.time, "sleep", lambda seconds: setattr(stand, "now", stand.now + seconds))
    stand.later.look()
    assert not stand.published


def test_a_rush_without_an_end_pushes_the_oldest_out(stand):
    said = in_a_rush(stand, 5, size=HOLD // 2)
    assert stand.published == said[:3] and stand.later.held <= HOLD


def test_what_must_go_now_takes_along_what_waits(stand):
    said = in_a_rush(stand, 3)
    stand.later.put(lambda: b"now", 100, wait=False)
    assert stand.published == [*said, b"now"]


FIELDS = ("force", "rate", "state", "acceleration")


@pytest.mark.parametrize("method", ["mrls", "constrained_kalman", "gauss_newton"])
def test_what_is_given_later_is_the_same(method):
    """To the last bit, whether the method's estimates are kept or computed again, and whatever has come since."""
    recording = oscillator_recording(noise=3.0)
    estimator, rows = make_estimator(oscillator(), recording.test, method), Rows(0, recording.time_ns, recording.values)
    state, _ = follow(estimator, estimator.init(), rows.first(100))
    state, columns = follow(estimator, state, rows.without(100).first(100))
    give, _ = columns.later(FIELDS)
    follow(estimator, state, rows.without(200))
    given = give()
    assert (given.number, len(given)) == (100, 100)
    np.testing.assert_array_equal(given.time_ns, columns.time_ns)
    for field in FIELDS:
        np.testing.assert_array_equal(given.of[field], columns.of[field])
        assert given.of[field].dtype == columns.of[field].dtype


def test_to_give_it_later_takes_no_memory_but_that_of_a_state():
    recording = oscillator_recording(n=1950)
    estimator = make_estimator(oscillator(), recording.test, "constrained_kalman")
    follower = Follower(estimator, Kept(recording.test))
    rows = Rows(0, recording.time_ns, recording.values)
    follower.keep(rows)
    _, size = follower.follow(rows).later(FIELDS)
    _, of_one = follow(estimator, estimator.init(), rows.first(1))[1].later(FIELDS)
    assert 0 < size == of_one
    give, _ = follower.follow(rows).later(FIELDS)
    assert np.shares_memory(give().time_ns, follower.kept.time_ns), "the samples are those that are kept anyway"
