"""What comes so fast that nobody can look at it, and when that is over."""

import pytest

from crash_estimator.rush import GOES_ON, LULL, PERIOD, Rush

LIMIT = 1000.0  # a second


class Stand:
    """A clock that the test turns."""

    def __init__(self):
        self.now = 7.0
        self.rush = Rush(LIMIT, lambda: self.now)

    def come(self, per_second: float, seconds: float) -> list[bool]:
        """So much a second in messages that come twice in a period -> what is seen after each."""
        seen = []
        for _ in range(round(2.0 * seconds / PERIOD)):
            self.now += 0.501 * PERIOD
            self.rush.count(0.501 * PERIOD * per_second)
            seen.append(self.rush.look())
        return seen


@pytest.fixture
def stand() -> Stand:
    return Stand()


def test_no_more_than_the_limit_is_none(stand):
    assert not any(stand.come(0.99 * LIMIT, 1.0))


def test_it_begins_with_the_first_period_of_more(stand):
    stand.come(0.5 * LIMIT, 1.0)
    assert stand.come(1.1 * LIMIT, 2.0 * PERIOD)[-1]


def test_it_goes_on_with_a_little_less_and_through_gaps(stand):
    stand.come(2.0 * LIMIT, 4.0 * PERIOD)
    assert all(stand.come(1.01 * GOES_ON * LIMIT, 1.0))
    for _ in range(5):
        assert all(stand.come(0.0, 0.7 * LULL))
        assert all(stand.come(2.0 * LIMIT, 2.0 * PERIOD))


@pytest.mark.parametrize("share", [0.0, 0.99 * GOES_ON])
def test_it_is_over_when_less_has_come_for_a_while(stand, share):
    stand.come(2.0 * LIMIT, 4.0 * PERIOD)
    seen = stand.come(share * LIMIT, LULL + 3.0 * PERIOD)
    assert seen[0] and not seen[-1]
    assert not any(stand.come(0.99 * LIMIT, 1.0)), "and begins as it did at first"
