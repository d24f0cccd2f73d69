"""A replay waits for its subscribers: with publishers that acknowledge when the test lets them."""

from crash_replay.flow import BYTES, LATE, ON_TIME, PATIENCE, PATIENCE_AGAIN, Flow


class Publisher:
    def __init__(self):
        self.acknowledged, self.asked = True, 0

    def wait_for_all_acked(self, timeout) -> bool:
        assert timeout.nanoseconds == 0  # a longer one stops all threads
        self.asked += 1
        return self.acknowledged


def flow_of(*publishers: Publisher) -> tuple[Flow, list[str]]:
    warnings = []
    return Flow(lambda: publishers, warnings.append, lambda: "/slow"), warnings


def test_it_has_room_for_so_many_messages_more_while_the_clock_is_kept():
    for on_time, limit in ((True, ON_TIME), (False, LATE)):
        publisher = Publisher()
        publisher.acknowledged = False
        flow, _ = flow_of(publisher)
        sent = 0
        while flow.has_room(0.0, on_time):
            flow.sent(1, 100)
            sent += 1
        assert sent == min(limit, BYTES // 100)


def test_a_publisher_that_holds_few_messages_gets_no_more_of_them():
    """Where the user's quality of service asks for a short history, what exceeds it would be lost."""
    for on_time in (True, False):
        publisher = Publisher()
        publisher.acknowledged = False
        flow = Flow(lambda publisher=publisher: [publisher], print, depth=10)
        sent = 0
        while flow.has_room(0.0, on_time):
            flow.sent(1, 100)
            sent += 1
        assert 1 <= sent < 10


def test_large_messages_count_by_their_bytes():
    publisher = Publisher()
    publisher.acknowledged = False
    flow, _ = flow_of(publisher)
    for _ in range(4):
        assert flow.has_room(0.0, on_time=True)
        flow.sent(1, 64_000)
    assert not flow.has_room(0.0, on_time=True)


def test_it_goes_on_when_all_publishers_are_acknowledged():
    fast, slow = Publisher(), Publisher()
    slow.acknowledged = False
    flow, warnings = flow_of(fast, slow)
    flow.sent(LATE, 0)
    assert not flow.has_room(0.0, on_time=False)
    slow.acknowledged = True
    assert flow.has_room(0.1, on_time=False)
    flow.sent(LATE - 1, 0)
    assert flow.has_room(0.2, on_time=False)
    assert warnings == []


def test_looking_in_a_pause_starts_the_count_anew():
    publisher = Publisher()
    flow, _ = flow_of(publisher)
    flow.sent(LATE - 1, 0)
    flow.look()
    publisher.acknowledged = False
    flow.sent(LATE - 1, 0)
    assert flow.has_room(0.0, on_time=False)


def test_few_messages_are_not_asked_after():
    publisher = Publisher()
    flow, _ = flow_of(publisher)
    flow.sent(10, 1000)
    flow.look()
    assert flow.has_room(0.0, on_time=True)
    assert publisher.asked == 0


def test_who_is_waited_for_is_said_within_a_second_and_not_with_every_message():
    publisher = Publisher()
    flow, warnings = flow_of(publisher)
    for k in range(20):  # a slow one takes 1 s each time
        publisher.acknowledged = False
        flow.sent(LATE, 0)
        began = 50.0 + k
        assert not flow.has_room(began, on_time=False)
        assert warnings or not k
        assert not flow.has_room(began + 0.9, on_time=False)
        assert warnings == ["what was sent is not taken: waiting for /slow"]
        publisher.acknowledged = True
        assert flow.has_room(began + 0.95, on_time=False)
    publisher.acknowledged = False
    assert not flow.all_taken(150.0) and not flow.all_taken(150.9)
    assert len(warnings) == 2


def test_another_one_that_is_waited_for_is_said_at_once():
    publisher, slow, warnings = Publisher(), ["/slow"], []
    publisher.acknowledged = False
    flow = Flow(lambda: [publisher], warnings.append, lambda: slow[0])
    flow.all_taken(50.0), flow.all_taken(50.9)
    slow[0] = "/other, which was killed"
    flow.all_taken(51.0), flow.all_taken(51.8), flow.all_taken(52.7)
    assert [line.split("for ")[1] for line in warnings] == ["/slow", "/other, which was killed"]


def test_it_says_so_when_a_subscriber_takes_nothing_and_goes_on():
    publisher = Publisher()
    publisher.acknowledged = False
    flow, warnings = flow_of(publisher)
    flow.sent(LATE, 0)
    assert not flow.has_room(50.0, on_time=False)
    assert not flow.has_room(50.0 + 0.99 * PATIENCE, on_time=False)
    assert warnings == ["what was sent is not taken: waiting for /slow"]
    assert flow.has_room(50.0 + 1.01 * PATIENCE, on_time=False)
    assert warnings[1:] == ["a subscriber has taken nothing for 10 s: going on, it may lose samples"]
    flow.sent(LATE, 0)
    assert not flow.has_room(70.0, on_time=False)


def test_who_takes_nothing_is_waited_for_long_only_once_until_something_is_taken():
    """Else each LATE messages of a recording cost PATIENCE, where a listener is stopped and the clock is lost."""
    publisher = Publisher()
    publisher.acknowledged = False
    flow, warnings = flow_of(publisher)
    now = 50.0
    for patience in (PATIENCE, PATIENCE_AGAIN, PATIENCE_AGAIN):
        flow.sent(LATE, 0)
        assert not flow.has_room(now, on_time=False)
        assert not flow.has_room(now + 0.9 * patience, on_time=False)
        now += 1.1 * patience
        assert flow.has_room(now, on_time=False)
    assert sum("going on" in line for line in warnings) == 1
    publisher.acknowledged = True
    flow.sent(LATE, 0)
    assert flow.has_room(now, on_time=False)
    publisher.acknowledged = False
    flow.sent(LATE, 0)
    assert not flow.has_room(now, on_time=False)
    assert not flow.has_room(now + 0.9 * PATIENCE, on_time=False), "it has taken part again"
