"""What a replay has kept to: its rate, its worst lateness."""

import numpy as np
from numpy.testing import assert_allclose

from crash_replay.player import Anchor, Batch, Player, Tally

MS = 1_000_000
TEN = np.arange(10, dtype=np.int64) * MS - 2 * MS  # 1 kHz, -2 ms ... 7 ms


def test_the_tally_knows_the_rate_and_the_worst_lateness():
    anchor = Anchor(100.0, 0)
    tally = Tally()
    tally.count(Batch(0, 1, 0, 100.0, anchor), 0, 100.001)
    assert tally.rate == 0.0
    tally.count(Batch(1, 3, 0, 100.2, anchor), 100 * MS, 100.201)
    assert_allclose(tally.rate, 0.1 / 0.201)
    tally.count(Batch(3, 9, 0, None, None), 900 * MS, 107.0)  # a burst counts as sent, not as played
    assert_allclose(tally.rate, 0.1 / 0.201)
    tally.count(Batch(9, 10, 0, 110.0, Anchor(110.0, 900 * MS)), 900 * MS, 110.0)
    assert_allclose(tally.rate, 0.1 / 0.201)
    assert (tally.samples, tally.messages) == (10, 4)
    assert_allclose(tally.worst_lateness, 1e-3, rtol=1e-9)


def test_the_present_rate_is_that_of_the_last_second_of_playing():
    anchor, tally = Anchor(0.0, 0), Tally()
    for k in range(500):  # 5 s at the rate 1, then 5 s at a fifth of it
        tally.count(Batch(k, k + 1, 0, 0.01 * k, anchor), 10 * k * MS, 0.01 * k)
    assert_allclose(tally.rate_now(), 1.0)
    for k in range(500, 600):
        tally.count(Batch(k, k + 1, 0, 0.01 * k, anchor), 10 * k * MS, 4.99 + 0.05 * (k - 499))
    assert_allclose(tally.rate_now(), 0.2)
    assert_allclose(tally.rate, 0.6, rtol=0.01)  # of all
    assert_allclose(tally.rate_now(late=1.0), 0.1, rtol=0.05)  # a subscriber holds it up


def test_the_present_rate_forgets_another_one():
    anchor, tally = Anchor(0.0, 0), Tally()
    for k in range(50):
        tally.count(Batch(k, k + 1, 0, 0.01 * k, anchor), 10 * k * MS, 0.01 * k)
    tally.forget_recent()
    for k in range(50, 60):
        tally.count(Batch(k, k + 1, 0, 0.01 * k, anchor), 10 * k * MS, 0.49 + 0.1 * (k - 49))
    assert_allclose(tally.rate_now(), 0.1)


def test_the_present_rate_is_known_where_less_than_one_message_is_sent_in_a_second():
    anchor, tally = Anchor(0.0, 0), Tally()
    for k in range(4):
        tally.count(Batch(k, k + 1, 0, 3.0 * k, anchor), 3 * k * MS, 3.0 * k)
    assert_allclose(tally.rate_now(), 0.001)


def test_late_is_what_is_due_and_has_not_been_sent():
    player = Player(TEN).resume(100.0)
    assert player.late(99.0) == 0.0
    assert_allclose(player.late(100.5), 0.5)
    assert player.pause(100.5).late(101.0) == 0.0


def test_a_loop_that_is_late_counts_its_lateness_once():
    """20 passes of 10 ms, each taking 20 ms."""
    tally, player = Tally(), Player(TEN, loop=True).resume(0.0)
    for k in range(200):
        player, batch = player.take(now := 0.002 * (k + 1))
        tally.count(batch, TEN[batch.stop - 1].item(), now)
    assert_allclose(tally.rate, 0.45, rtol=0.02)  # of 10 ms, 9 ms lie between samples
