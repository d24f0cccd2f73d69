"""Following a test forward, back and in jumps: whichever way leads to a sample, the state is the same."""

import re
from itertools import pairwise

import numpy as np
import pytest
from helpers_estimation import ESTIMATED, oscillator, oscillator_recording
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from crash_estimator.core.effects.change import add_effect
from crash_estimator.core.fold import run
from crash_estimator.core.methods import METHODS, make_estimator
from crash_estimator.core.structure import Coefficient
from crash_estimator.following.again import estimated_again
from crash_estimator.following.alignment import PATIENCE, Alignment
from crash_estimator.following.arrivals import Arrivals
from crash_estimator.following.checkpoints import LIMIT, STRIDE, Checkpoints
from crash_estimator.following.columns import columns_of, follow
from crash_estimator.following.follower import Follower
from crash_estimator.kept import Kept, Rows
from crash_replay.recording import Recording

DAMPED = {"damping": Coefficient(0.0, estimated=True, std=100.0)}
METHODS_HERE = [name for name in METHODS if name != "effective_mass"]  # which needs a structure of its own
BANK = {"gauss_newton_orders": {"largest": 1}}  # of four orders, which follow as nine do
COMPILED = ("rls", "mrls", "kalman", "constrained_kalman")  # the others take a hundred times as long


@pytest.fixture(scope="module")
def recording() -> Recording:
    recording = oscillator_recording(noise=5.0, n=350)
    recording.values[200:204, 0] = np.nan  # a dropout, to have its events
    return recording


def enough(recording: Recording, method: str) -> Recording:
    """For a method that is not compiled a record that ends soon after the dropout: contact, fade and gap are in it."""
    last = len(recording) if method in COMPILED else 260
    return Recording(recording.test, recording.time_ns[:last], recording.values[:last])


def rows_of(recording: Recording, start: int, stop: int) -> Rows:
    return Rows(start, recording.time_ns[start:stop], recording.values[start:stop])


def follower_of(recording: Recording, method: str = "mrls", **more) -> Follower:
    given = BANK.get(method, {}) | more
    estimator = make_estimator(oscillator(ESTIMATED, **DAMPED), recording.test, method, **given)
    return Follower(estimator, Kept(recording.test))


def take(follower: Follower, recording: Recording, start: int, stop: int):
    rows = rows_of(recording, start, stop)
    follower.keep(rows)
    return follower.follow(rows)


def assert_same(columns, expected, start: int = 0):
    """columns of samples start, ... are the rows of `expected`, which begins with sample 0."""
    rows = slice(columns.number - start, columns.number - start + len(columns))
    assert_array_equal(columns.time_ns, expected.time_ns[rows])
    assert columns.of.keys() == expected.of.keys()
    for name, table in columns.of.items():
        assert_array_equal(table, expected.of[name][rows], err_msg=name)
        assert table.dtype == expected.of[name].dtype
    said = [(row + rows.start, event) for row, event in columns.events]
    assert said == [(row, event) for row, event in expected.events if rows.start <= row < rows.stop]


@pytest.fixture(scope="module")
def whole(recording):
    """Method -> what the one loop says, sample by sample."""
    return {
        m: columns_of(run(follower_of(recording, m).estimator, enough(recording, m).samples())) for m in METHODS_HERE
    }


@pytest.mark.parametrize("method", METHODS_HERE)
@pytest.mark.parametrize("block", [7, 1000])
def test_blocks_give_what_single_samples_give(recording, whole, method, block):
    recording, estimator = enough(recording, method), follower_of(recording, method).estimator
    state = estimator.init()
    for start in range(0, len(recording), block):
        state, columns = follow(estimator, state, rows_of(recording, start, min(start + block, len(recording))))
        assert_same(columns, whole[method])


def test_there_is_something_to_tell_of(whole):
    kinds = {event.kind for columns in whole.values() for _, event in columns.events}
    assert {"loading", "unloading", "dropout", "rewound"} <= kinds


@pytest.mark.parametrize("method", METHODS_HERE)
def test_any_way_leads_to_the_same_estimates(recording, whole, method):
    recording = enough(recording, method)

    @settings(max_examples=25 if method in COMPILED else 3, deadline=None)
    @given(st.lists(st.tuples(st.integers(0, len(recording) - 1), st.integers(1, 60)), min_size=1, max_size=6))
    def check(jumps):
        follower = follower_of(recording, method)
        take(follower, recording, 0, len(recording) // 2)
        follower.keep(rows_of(recording, 0, len(recording)))  # as asked of the replay
        for start, count in jumps:
            stop = min(start + count, len(recording))
            assert_same(take(follower, recording, start, stop), whole[method])

    check()


def test_a_gap_is_named_and_what_comes_to_fill_it_counts_from_then_on(recording, whole):
    follower = follower_of(recording)
    take(follower, recording, 0, 100)
    follower.keep(rows_of(recording, 150, 160))
    assert follower.gap(150) == (100, 150)
    across = follower.follow(rows_of(recording, 150, 160))
    assert np.abs(across.of["value"] - whole["mrls"].of["value"][150:160]).max() > 0.0
    assert follower.gap(160) is None and follower.holds_from(160) == 150
    follower.keep(rows_of(recording, 120, 150))
    assert follower.gap(150) == (100, 120) and follower.holds_from(160) == 120
    follower.keep(rows_of(recording, 100, 120))
    assert follower.gap(150) is None and follower.holds_from(160) == 0
    assert_same(follower.follow(rows_of(recording, 150, 160)), whole["mrls"])


def test_who_joins_late_holds_from_there_and_gives_the_same_again(recording):
    follower = follower_of(recording)
    first = take(follower, recording, 150, 200)
    assert follower.holds_from(200) == 150
    take(follower, recording, 200, 290)
    assert_same(take(follower, recording, 150, 200), first, start=150)


def test_from_a_floor_on_it_is_as_if_nothing_had_been(recording):
    follower = follower_of(recording)
    take(follower, recording, 0, 100)
    reset = Follower(follower.estimator, follower.kept, floor=100)
    assert reset.gap(100) is None and reset.holds_from(100) == 100
    fresh = follower_of(recording)
    assert_same(take(reset, recording, 100, 150), take(fresh, recording, 100, 150), start=100)


def test_going_back_costs_a_short_way_and_memory_is_bounded():
    checkpoints = Checkpoints(np.zeros(1))
    n = 40 * STRIDE * LIMIT
    for number in range(0, n, 10):
        checkpoints.offer(number, np.full(1, number))
    assert len(checkpoints.numbers) <= LIMIT and checkpoints.numbers[0] == 0
    longest = max(later - earlier for earlier, later in pairwise([*checkpoints.numbers, n]))
    assert longest <= 2 * checkpoints.stride + 10 and checkpoints.stride <= 4 * n / LIMIT
    for number in (0, 1, STRIDE, n // 2, n):
        at, state = checkpoints.before(number)
        assert at <= number and state == at


def test_a_checkpoint_does_not_hold_a_block_in_memory(recording):
    follower = follower_of(recording)
    take(follower, recording, 0, 300)
    state, estimator = follower.checkpoints.states[-1], follower.estimator
    assert state.base is None and len(estimator.last_row(state)) < 300


def test_what_is_lost_sent_twice_or_begins_a_pass_is_told_apart(recording):
    arrivals = Arrivals()

    def receive(run, start, stop):
        arrival = arrivals.receive(run, rows_of(recording, start, stop))
        return arrival.begins, arrival.lost, arrival.repeated, arrival.rows.number, len(arrival.rows.time_ns)

    assert receive(0, 20, 30) == (True, 0, 0, 20, 10)  # joined late: not lost
    assert receive(0, 30, 40) == (False, 0, 0, 30, 10)
    assert receive(0, 43, 50) == (False, 3, 0, 43, 7)
    assert receive(0, 45, 55) == (False, 0, 5, 50, 5)
    assert receive(0, 45, 55) == (False, 0, 10, 55, 0)
    assert receive(1, 10, 20) == (True, 0, 0, 10, 10)  # sought
    assert receive(1, 0, 5) == (True, 0, 0, 0, 5)  # a replay that was started anew
    assert arrivals.missed == 3


class Fed:
    """What an alignment hands out."""

    def __init__(self, recording: Recording):
        self.passes: list[list[tuple[int, int, np.ndarray]]] = []
        self.renumbered: list[bool] = []
        self.alignment = Alignment(recording.test, recording.sample_period, self.begin, self.take)

    def begin(self, renumbered: bool) -> None:
        self.renumbered.append(renumbered)
        self.passes.append([])

    def take(self, rows: Rows) -> None:
        self.passes[-1].append((rows.number, int(rows.time_ns[0]), rows.values[0]))

    def send(self, recording: Recording, samples, channels=None, leave_out=()) -> None:
        for number in samples:
            for channel in range(len(recording.test.channels)) if channels is None else channels:
                if (number, channel) not in leave_out:
                    time_ns, value = recording.time_ns[number], recording.values[number, channel]
                    self.alignment.put(channel, int(time_ns), float(value))

    def assert_is(self, recording: Recording, pass_: int, samples, first: int = 0) -> None:
        handed_out = self.passes[pass_]
        assert [number for number, _, _ in handed_out] == [number - first for number in samples]
        assert [time_ns for _, time_ns, _ in handed_out] == recording.time_ns[list(samples)].tolist()
        assert_array_equal([values for _, _, values in handed_out], recording.values[list(samples)])


def test_channels_one_by_one_are_samples_again(recording):
    fed = Fed(recording)
    fed.send(recording, range(len(recording)))
    fed.assert_is(recording, 0, range(len(recording)))


def test_a_channel_may_run_ahead_of_the_others_over_the_end_of_a_pass(recording):
    fed = Fed(recording)
    for channels in ([2], [0, 1]):
        fed.send(recording, range(60), channels)
        fed.send(recording, range(60), channels)
    fed.assert_is(recording, 0, range(60))
    fed.assert_is(recording, 1, range(60))
    assert fed.renumbered == [False, False]


def test_a_value_that_never_comes_is_nan_and_holds_up_nothing(recording):
    fed = Fed(recording)
    fed.send(recording, range(10), leave_out={(4, 1)})
    assert [number for number, _, _ in fed.passes[0]] == list(range(10))
    assert np.isnan(fed.passes[0][4][2][1]) and not np.isnan(fed.passes[0][5][2][1])


def test_a_silent_channel_is_waited_for_so_long_only(recording):
    fed = Fed(recording)
    fed.send(recording, range(PATIENCE), channels=[0, 1])
    assert not fed.passes
    fed.send(recording, range(PATIENCE, PATIENCE + 10), channels=[0, 1])
    assert len(fed.passes[0]) == 10
    fed.alignment.flush()
    assert len(fed.passes[0]) == PATIENCE + 10
    assert np.isnan([values[2] for _, _, values in fed.passes[0]]).all()


def test_lost_samples_leave_their_numbers_free(recording):
    fed = Fed(recording)
    fed.send(recording, [*range(10), *range(13, 20)])
    fed.assert_is(recording, 0, [*range(10), *range(13, 20)])
    fed.send(recording, range(20))
    fed.assert_is(recording, 1, range(20))
    assert fed.renumbered == [False, False]


def test_numbers_count_from_the_earliest_sample_seen(recording):
    fed = Fed(recording)
    fed.send(recording, range(30, 40))
    fed.send(recording, range(40))
    fed.assert_is(recording, 0, range(30, 40), first=30)
    fed.assert_is(recording, 1, range(40))
    assert fed.renumbered == [False, True]


def test_a_coefficient_that_was_given_is_told_without_a_sigma_one_that_is_estimated_with_it(recording):
    follower = follower_of(recording)
    take(follower, recording, 0, len(recording))

    def told(coefficient: float | None) -> str:
        structure = add_effect(oscillator(ESTIMATED, **DAMPED), "coulomb_friction", "spring", coefficient=coefficient)
        return estimated_again(follower, make_estimator(structure, recording.test, "mrls"))[1]

    assert told(20.0) == "400 samples estimated again; spring.coulomb_friction 20 N, as given"
    assert re.fullmatch(r"400 samples estimated again; spring.coulomb_friction \S+ \+- [1-9.]\S* N", told(None))
