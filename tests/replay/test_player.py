"""The clockwork alone: the wall clock is a number that the tests choose."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from crash_replay.player import CommandError, Mode, Player, suitable_block

MS = 1_000_000
TEN = np.arange(10, dtype=np.int64) * MS - 2 * MS  # 1 kHz, -2 ms ... 7 ms


def run(player: Player, begin: float, end: float, block: int = 1, step: float = 1e-4):
    """All batches that a player gives while the wall clock goes from begin to end, with the time each came at."""
    batches = []
    for now in np.arange(begin, end, step):
        while True:
            player, batch = player.take(now, block)
            if batch is None:
                break
            batches.append((float(now), batch))
    return player, batches


def numbers(batches) -> list[int]:
    return [number for _, batch in batches for number in range(batch.start, batch.stop)]


def test_it_waits_until_it_is_resumed_and_finishes_after_the_last_sample():
    player = Player(TEN)
    assert player.mode == Mode.WAITING
    assert player.due() is None
    player, batches = run(player.resume(100.0), 100.0, 101.0)
    assert numbers(batches) == list(range(10))
    assert (player.mode, player.next, player.run) == (Mode.FINISHED, 10, 0)


@pytest.mark.parametrize("rate", [0.001, 0.5, 1.0, 1000.0])
def test_each_sample_is_due_at_its_time_in_the_crash_over_the_rate(rate):
    player = Player(TEN, rate).resume(100.0)
    for k in range(10):
        assert_allclose(player.due() - 100.0, k * 1e-3 / rate, atol=1e-9)
        player, batch = player.take(1e9)
        assert (batch.start, batch.stop, batch.run) == (k, k + 1, 0)


def test_lateness_does_not_add_up():
    """Samples taken late do not push the later ones back."""
    player = Player(TEN).resume(0.0)
    for late in (0.0, 0.9e-3, 0.5e-3, 0.0):
        due = player.due()
        player, _ = player.take(due + late)
    assert_allclose(player.due(), 4e-3, atol=1e-12)


def test_irregular_stamps_are_followed():
    player = Player(np.array([0, 1 * MS, 7 * MS, 8 * MS])).resume(0.0)
    _, batches = run(player, 0.0, 0.02)
    assert_allclose([batch.due for _, batch in batches], [0.0, 1e-3, 7e-3, 8e-3], atol=1e-12)


def test_a_block_is_due_with_its_last_sample_and_the_last_block_is_what_is_left():
    player, batches = run(Player(TEN).resume(0.0), 0.0, 1.0, block=4)
    assert [(batch.start, batch.stop) for _, batch in batches] == [(0, 4), (4, 8), (8, 10)]
    assert_allclose([batch.due for _, batch in batches], [3e-3, 7e-3, 9e-3], atol=1e-12)


def test_pause_keeps_what_is_left_of_the_way_to_the_next_sample():
    player, _ = run(Player(TEN).resume(0.0), 0.0, 0.0022)
    player = player.pause(0.0024)
    assert (player.mode, player.next) == (Mode.PAUSED, 3)
    assert player.take(1e9)[1] is None
    player = player.resume(50.0)
    assert_allclose(player.due() - 50.0, 0.6e-3, atol=1e-9)


def test_pause_before_a_late_sample_has_no_time_pass_beyond_it():
    player = Player(TEN).resume(0.0).pause(5.0).resume(50.0)
    assert_allclose(player.due(), 50.0)


def test_toggle_pauses_and_resumes():
    player = Player(TEN).toggle(0.0)
    assert player.mode == Mode.PLAYING
    player = player.toggle(0.5e-3)
    assert player.mode == Mode.PAUSED
    assert player.toggle(1.0).mode == Mode.PLAYING


def test_a_new_rate_counts_from_where_the_replay_is():
    player, _ = run(Player(TEN).resume(0.0), 0.0, 0.0022)
    player = player.set_rate(0.1, 0.0024)
    assert_allclose(player.due(), 0.0024 + 0.6e-3 / 0.1, atol=1e-9)


@pytest.mark.parametrize("rate", [0.0, -1.0, 0.0009, 1000.1, float("nan"), float("inf")])
def test_a_rate_out_of_range_is_refused(rate):
    with pytest.raises(CommandError, match=r"rate must be between 0\.001 and 1000 times real time, got"):
        Player(TEN).set_rate(rate, 0.0)


def test_steps_go_out_at_once_and_leave_it_paused():
    player, _ = run(Player(TEN).resume(0.0), 0.0, 0.0022)
    player, batches = run(player.step(3, 0.0024), 0.0024, 0.5)
    assert numbers(batches) == [3, 4, 5]
    assert all((now, batch.due) == (0.0024, None) for now, batch in batches)
    assert (player.mode, player.next, player.run) == (Mode.PAUSED, 6, 0)
    assert_allclose(player.resume(9.0).due(), 9.0)


def test_a_burst_goes_out_in_blocks_of_no_more_than_was_asked_for():
    player, batches = run(Player(TEN).burst(6, 0.0), 0.0, 0.01, block=4)
    assert [(batch.start, batch.stop) for _, batch in batches] == [(0, 4), (4, 6)]
    assert player.mode == Mode.PAUSED


def test_a_pause_drops_the_rest_of_a_burst():
    player, _ = Player(TEN).burst(6, 0.0).take(0.0)
    assert run(player.pause(0.0), 0.0, 1.0)[1] == []


def test_steps_add_up():
    """Three keys pressed before the first step is sent are three steps, there and back."""
    far = Player(np.arange(50, dtype=np.int64) * MS)
    three = far.step(10, 0.0).step(10, 0.0).step(10, 0.0)
    player, batches = run(three, 0.0, 0.01, block=4)
    assert numbers(batches) == list(range(30)) and player.mode == Mode.PAUSED
    half, _ = far.step(10, 0.0).take(0.0, 4)
    assert numbers(run(half.step(-2, 0.0), 0.0, 0.01)[1]) == [4, 5, 6, 7]  # there were six to send
    back = half.step(-8, 0.0)
    assert (back.next, back.pending, back.run) == (2, 0, 1)
    assert numbers(run(far.burst(10, 0.0).burst(5, 0.0), 0.0, 0.01)[1]) == list(range(15))


def test_a_burst_of_nothing_is_of_all_that_are_left():
    player, _ = run(Player(TEN).step(3, 0.0), 0.0, 0.01)
    player, batches = run(player.burst(0, 1.0), 1.0, 1.01)
    assert numbers(batches) == list(range(3, 10)) and player.mode == Mode.FINISHED
    with pytest.raises(CommandError, match="no sample is left"):
        player.burst(0, 2.0)


def test_a_position_is_where_the_replay_is_now():
    player = Player(TEN, rate=0.5)
    assert player.position_ns(0.0) == TEN[0]
    player, _ = run(player.resume(0.0), 0.0, 0.0041)  # the samples at 0, 1 and 2 ms
    assert player.position_ns(0.005) == TEN[0] + round(2.5 * MS)
    assert player.position_ns(9.0) == TEN[3]  # not beyond what is to be sent
    paused = player.pause(0.005)
    assert paused.position_ns(7.0) == TEN[0] + round(2.5 * MS)
    assert paused.seek(TEN[8].item(), 7.0).position_ns(7.0) == TEN[8]
    finished, _ = run(player.burst(0, 1.0), 1.0, 1.1)
    assert finished.position_ns(2.0) == TEN[9]


def test_a_burst_beyond_the_end_finishes():
    player, batches = run(Player(TEN).burst(99, 0.0), 0.0, 0.01)
    assert numbers(batches) == list(range(10))
    assert (player.mode, player.pending) == (Mode.FINISHED, 0)
    with pytest.raises(CommandError, match="no sample is left: sample 9 was the last"):
        player.step(1, 0.0)


def test_a_step_of_nothing_pauses():
    player = Player(TEN).resume(0.0).step(0, 0.0005)
    assert player.mode == Mode.PAUSED
    assert_allclose(player.resume(1.0).due(), 1.0)


def test_a_step_back_begins_a_new_run():
    player, _ = run(Player(TEN).burst(5, 0.0), 0.0, 0.01)
    player = player.step(-2, 1.0)
    assert (player.mode, player.next, player.run) == (Mode.PAUSED, 3, 1)
    assert player.take(1e9)[1] is None
    player, batches = run(player.step(1, 1.0), 1.0, 1.01)
    assert [(batch.start, batch.run) for _, batch in batches] == [(3, 1)]


def test_a_step_back_ends_at_the_first_sample():
    player, _ = run(Player(TEN).burst(5, 0.0), 0.0, 0.01)
    player = player.step(-50, 1.0)
    assert (player.next, player.run) == (0, 1)
    with pytest.raises(CommandError, match="cannot go back: sample 0 is the first"):
        player.step(-1, 1.0)


@pytest.mark.parametrize("time_ns, number", [(-2 * MS, 0), (0, 2), (1, 3), (7 * MS, 9)])
def test_seek_goes_to_the_first_sample_at_or_after_the_time(time_ns, number):
    playing = Player(TEN).resume(0.0).seek(time_ns, 0.5)
    assert (playing.mode, playing.next, playing.run) == (Mode.PLAYING, number, 1)
    assert_allclose(playing.due(), 0.5)
    paused = Player(TEN).pause(0.0).seek(time_ns, 0.5)
    assert (paused.mode, paused.next, paused.run) == (Mode.PAUSED, number, 1)


@pytest.mark.parametrize("time_ns", [-2 * MS - 1, 7 * MS + 1])
def test_seek_outside_the_recording_is_refused(time_ns):
    with pytest.raises(CommandError, match=r"time must be between -0\.002 and 0\.007 s, got"):
        Player(TEN).seek(time_ns, 0.0)


def test_after_the_end_resume_plays_again_and_seek_waits_there():
    player, _ = run(Player(TEN).resume(0.0), 0.0, 0.1)
    again, batches = run(player.resume(5.0), 5.0, 5.1)
    assert numbers(batches) == list(range(10))
    assert again.run == 1
    assert (player.seek(0, 5.0).mode, player.seek(0, 5.0).next) == (Mode.PAUSED, 2)
    assert player.pause(5.0).mode == Mode.FINISHED


def test_loops_follow_each_other_one_sample_period_apart_as_new_runs():
    _, batches = run(Player(TEN, loop=True).resume(0.0), 0.0, 0.0295)
    assert numbers(batches) == [*range(10)] * 3
    assert [batch.run for _, batch in batches] == [0] * 10 + [1] * 10 + [2] * 10
    assert_allclose([batch.due for _, batch in batches], np.arange(30) * 1e-3, atol=1e-9)


def test_a_burst_goes_round_a_loop():
    player, batches = run(Player(TEN, loop=True).burst(12, 0.0), 0.0, 0.01)
    assert numbers(batches) == [*range(10), 0, 1]
    assert (player.mode, player.next, player.run) == (Mode.PAUSED, 2, 1)


def test_a_window_of_the_recording():
    player = Player(TEN, first=3, end=6, loop=True).resume(0.0)
    player, batches = run(player, 0.0, 0.0055)
    assert numbers(batches) == [3, 4, 5, 3, 4, 5]
    with pytest.raises(CommandError, match="time must be between"):
        player.seek(-2 * MS, 0.0)
    with pytest.raises(CommandError, match="nothing to play"):
        Player(TEN, first=6, end=6)


def test_one_sample_is_a_recording_too():
    player, batches = run(Player(TEN[:1]).resume(0.0), 0.0, 0.01)
    assert numbers(batches) == [0]
    assert player.mode == Mode.FINISHED


COMMANDS = st.one_of(
    st.tuples(st.sampled_from(["pause", "resume", "toggle"])),
    st.tuples(st.just("step"), st.integers(-12, 12)),
    st.tuples(st.just("burst"), st.integers(0, 12)),
    st.tuples(st.just("seek"), st.integers(-3 * MS, 8 * MS)),
    st.tuples(st.just("set_rate"), st.sampled_from([0.001, 0.3, 7.0, 1000.0])),
)


@given(st.lists(st.tuples(COMMANDS, st.floats(0.0, 5e-3))), st.integers(1, 4), st.booleans())
def test_whatever_is_commanded_no_number_is_left_out_or_repeated_within_a_run(commands, block, loop):
    player, now, sent = Player(TEN, loop=loop), 0.0, {}
    for (name, *arguments), wait in commands:
        try:
            player = getattr(player, name)(*arguments, now)
        except CommandError:
            pass
        now += wait
        for _ in range(50):
            due = player.due(block)
            player, batch = player.take(now, block)
            assert (batch is None) == (due is None or due > now)
            if batch is None:
                break
            sent.setdefault(batch.run, []).extend(range(batch.start, batch.stop))
    for of_run in sent.values():
        assert of_run == list(range(of_run[0], of_run[0] + len(of_run)))
    assert player.run >= max(sent, default=0)


def test_commands_leave_the_player_they_are_given_to_as_it_was():
    player = Player(TEN).resume(0.0)
    for command in (Player.pause, Player.toggle):
        command(player, 1.0)
    player.step(2, 1.0), player.seek(0, 1.0), player.take(1.0)
    assert (player.mode, player.next, player.run, player.pending) == (Mode.PLAYING, 0, 0, 0)


@pytest.mark.parametrize(
    "period, rate, channels, block",
    [
        (1e-3, 1.0, 16, 1),
        (1e-4, 0.1, 16, 1),  # 1000 messages a second
        (1e-3, 1.1, 16, 3),
        (1e-4, 1.0, 16, 25),  # 400 messages a second
        (5e-5, 1.0, 16, 50),
        (1e-4, 0.01, 16, 1),
        (1e-4, 1000.0, 16, 477),  # 65 kB
        (1e-4, 1000.0, 1, 4062),
        (0.0, 1000.0, 1, 1),
    ],
)
def test_single_messages_up_to_1000_a_second_and_above_it_blocks(period, rate, channels, block):
    assert suitable_block(period, rate, channels) == block
