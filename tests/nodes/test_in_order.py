"""What an estimator says, put into its order and made whole."""

import pytest

from crash_estimator.following.in_order import About, InOrder


@pytest.fixture
def stream():
    out = []
    stream = InOrder(lambda data: out.append(data))
    stream.out = out
    return stream


def say(stream: InOrder, *numbers: int, run: int = 0, first: int = 0) -> None:
    for number in numbers:
        stream.receive(About(run, number, 1), f"{run}:{number}", first)


def test_what_comes_in_order_goes_on_at_once(stream):
    say(stream, 0, 1, 2)
    assert stream.out == ["0:0", "0:1", "0:2"]
    assert stream.gap() is None and stream.has(0) == 3 and stream.reached(0, 3)


def test_what_comes_after_a_gap_waits_until_it_is_filled(stream):
    say(stream, 0, 3, 4)
    assert stream.out == ["0:0"] and stream.gap() == (1, 3)
    stream.fill(About(0, 1, 1), "again 1")
    assert stream.gap() == (2, 3)
    stream.fill(About(0, 2, 1), "again 2")
    assert stream.out == ["0:0", "again 1", "again 2", "0:3", "0:4"]
    assert stream.has(0) == 5 and not stream.lost


def test_what_cannot_be_had_is_counted_and_the_rest_goes_on(stream):
    say(stream, 0, 3, 4)
    stream.give_up(3)
    assert stream.out == ["0:0", "0:3", "0:4"]
    assert (stream.lost, stream.has(0)) == (2, 3) and stream.reached(0, 5)


def test_what_nothing_comes_after_is_missed_by_what_the_estimator_says_of_itself(stream):
    say(stream, 0)
    stream.expect(0, 0, 4)
    assert stream.gap() == (1, 4) and not stream.reached(0, 4)


def test_a_pass_of_which_nothing_came_is_missed_too(stream):
    say(stream, 0, 1)
    stream.expect(1, 5, 8)
    assert stream.gap() == (5, 8) and stream.has(0) == 0


def test_who_joins_late_lacks_the_beginning(stream):
    say(stream, 7)
    assert stream.out == [] and stream.gap() == (0, 7)


def test_a_pass_that_begins_later_lacks_nothing(stream):
    say(stream, 5, 6, first=5)
    assert stream.gap() is None and stream.has(0) == 2


@pytest.mark.parametrize("run", [0, 1])
def test_a_new_pass_lets_go_of_the_old_one(stream, run):
    """Also one of a replay that was started anew and counts its runs from 0 again."""
    say(stream, 0, 2)
    say(stream, 0, 1, run=run)
    assert stream.out == ["0:0", "0:2", f"{run}:0", f"{run}:1"]
    assert stream.has(run) == 2 and stream.gap() is None


def test_what_has_come_already_is_left_out(stream):
    say(stream, 0, 1, 1, 2)
    assert stream.out == ["0:0", "0:1", "0:2"] and stream.has(0) == 3
