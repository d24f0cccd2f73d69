"""In a rush the estimates go first: what is for who looks on comes after it, all of it and in its order."""

import numpy as np
import pytest

from crash_estimator.following.columns import Columns, Parts
from crash_estimator.nodes import later
from crash_estimator.nodes.later import HOLD, PERIOD, RUSH, Later


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
    stand.now += 2.0 * PERIOD
    stand.later.look()
    assert stand.published == said and not stand.later.held


def test_what_comes_after_a_rush_comes_after_what_waits(stand):
    said = in_a_rush(stand, 3)
    stand.say(b"last", 1, 2.0 * PERIOD)
    assert not stand.published
    stand.later.look()
    assert stand.published == [*said, b"last"]


def test_no_faster_than_it_is_taken(stand, monkeypatch):
    in_a_rush(stand, 3)
    stand.now += 2.0 * PERIOD
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


@pytest.mark.parametrize("of_rows", [True, False])
def test_fields_are_kept_without_the_others(of_rows):
    rows = np.random.default_rng(1).normal(size=(4, 9)).round(1)
    rows[:, 5:7] = [[0, 1], [2, 3], [3, 2], [1, 0]]
    places = {"parameters": slice(0, 3), "force": slice(3, 5), "state": slice(5, 7), "rate": slice(7, 9)}
    whole = Parts(rows, places)
    of = whole if of_rows else {field: whole[field] for field in ("value", "force", "state", "rate")}
    columns = Columns(7, np.arange(4), of, ())
    kept = columns.only(("force", "state"))
    assert (kept.number, len(kept)) == (7, 4)
    for field in ("force", "state"):
        np.testing.assert_array_equal(kept.of[field], columns.of[field])
        assert kept.of[field].dtype == columns.of[field].dtype
    assert not of_rows or kept.of.table.shape == (4, 4)
