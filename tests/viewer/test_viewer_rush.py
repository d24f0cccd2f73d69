"""The viewer's recorder where more comes than can be drawn at once: what is put off, and for how long."""

import time
from threading import Event

import pytest
from helpers_viewer import recorder, settle
from helpers_waiting import PATIENCE

from crash_estimator.viewer.recorder import HOLD, MOST, SHARE

pytestmark = pytest.mark.usefixtures("strict")


def test_what_comes_in_a_rush_is_drawn_when_enough_of_it_waits_and_the_rest_at_once(tmp_path, monkeypatch):
    """The estimators may need what drawing would take."""
    big = round(HOLD / 10)
    monkeypatch.setattr("crash_estimator.viewer.recorder.RUSH", big / (2 * PATIENCE))
    target, drawn = recorder(tmp_path / "rush.rrd"), []
    began = time.monotonic()
    put = 0
    while not drawn and time.monotonic() - began < PATIENCE:
        target.put(lambda: drawn.append(put), size=big)  # noqa: B023 - how many were put when it is drawn
        put += 1
        time.sleep(0.02)
    assert drawn[0] >= 10
    settle(target)
    drawn.clear()
    target.put(lambda: drawn.append(0), size=1000)
    settle(target)
    assert drawn == [0]
    target.close()


def test_what_follows_a_rush_is_not_put_off_for_the_time_that_drawing_the_rush_took(tmp_path, monkeypatch):
    """The forces, which the estimators have put off too, are all that is missing in the picture then."""
    monkeypatch.setattr("crash_estimator.viewer.recorder.RUSH", 1e6)
    monkeypatch.setattr("crash_estimator.viewer.recorder.LONGEST", PATIENCE)
    target, drawn = recorder(tmp_path / "after.rrd"), []
    target.put(lambda: time.sleep(0.5), size=10_000_000)
    settle(target)
    after = time.monotonic()
    target.put(lambda: drawn.append(time.monotonic()), size=1000)
    settle(target)
    assert drawn[0] - after < 0.5 * 0.5 * (1 - SHARE) / SHARE, "half the pause after as long a batch otherwise"
    target.close()


def test_more_bytes_than_may_wait_make_curves_coarser(tmp_path):
    target, goes_on = recorder(tmp_path / "much.rrd"), Event()
    target.put(lambda: goes_on.wait(PATIENCE) and None)  # Rerun is held up
    time.sleep(0.2)
    for _ in range(30):
        target.put(lambda: None, stream="curve", size=round(MOST / 10))
    assert target.dropped > 10
    goes_on.set()
    settle(target)
    target.close()


def test_a_batch_that_takes_long_is_not_followed_by_a_pause_of_many_times_as_long(tmp_path):
    """Short passes of a loop would come faster than they are drawn, and all that waits would grow without end."""
    target, drawn = recorder(tmp_path / "slow.rrd"), []
    target.put(lambda: time.sleep(1.0), size=1000)
    settle(target)
    after = time.monotonic()
    target.put(lambda: drawn.append(time.monotonic()), size=1000)
    settle(target)
    assert drawn[0] - after < 0.5 * (1 - SHARE) / SHARE, "half the pause that its share of the time would ask for"
    target.close()
