"""The thread that sends, without ROS: what it sends, when, and how commands of another thread get through."""

import time
from threading import Thread, Timer

import numpy as np
import pytest
from helpers_waiting import PATIENCE

from crash_replay.pacing import Pacing, SubscribersMissing
from crash_replay.player import Mode, Player
from crash_replay.recording import Channel, Recording, Test


class Audience:
    """Subscribers, and what they say of themselves."""

    def __init__(self, subscribers: int):
        self.subscribers = subscribers
        self.preparing: list[str] = []
        self.lack: dict[str, str] = {}  # what, by the names of those who ask for it
        self.lost: dict[str, str] = {}  # likewise of those who are gone
        self.warnings: list[str] = []

    def ready(self):
        return self.subscribers

    def subscribed(self):
        return [f"node{k}" for k in range(self.subscribers)]

    def not_ready(self, names):
        return [name for name in names if name in self.preparing]

    def forget_gone(self):
        self.lost.clear()

    def behind(self, run, sent):
        return list(self.lack)

    def lacking(self, run, sent):
        return [f"{name} has {what}" for name, what in {**self.lack, **self.lost}.items()]

    def warn(self, text):
        self.warnings.append(text)


class Outlet:
    """Takes what the pacing sends, as long as it has room."""

    def __init__(self, subscribers: int = 1):
        self.batches, self.states = [], []
        self.room, self.arrived, self.audience = True, True, Audience(subscribers)

    def send(self, batch):
        self.batches.append((time.perf_counter(), batch))

    def send_state(self, player, tally, block, rate):
        self.states.append((player.mode, player.next))

    def has_room(self, now, on_time):
        return self.room

    def wait_for_room(self):
        pass

    def look(self):
        pass

    def test_has_arrived(self):
        return self.arrived

    all_have_arrived = test_has_arrived

    def numbers(self):
        return [number for _, batch in self.batches for number in range(batch.start, batch.stop)]


def pacing_of(n: int = 20, period_ns: int = 1_000_000, block: int = 1, outlet=None, **options) -> Pacing:
    time_ns = np.arange(n, dtype=np.int64) * period_ns
    recording = Recording(Test("T", (Channel("a", "acceleration"),)), time_ns, np.zeros((n, 1)))
    return Pacing(recording, Player(time_ns, **options), outlet or Outlet(), block)


@pytest.fixture
def playing():
    """Starts pacings in threads of their own, which end with the test."""
    started = []

    def start(pacing: Pacing, **options) -> Pacing:
        thread = Thread(target=pacing.play, kwargs=options)
        thread.start()
        started.append((pacing, thread))
        return pacing

    yield start
    for pacing, thread in started:
        pacing.stopped = True
        with pacing.changed:
            pacing.changed.notify_all()  # it looks when it next wakes up
        thread.join()


def wait_until(condition, timeout: float = PATIENCE) -> None:
    limit = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < limit, "waited in vain"
        time.sleep(0.001)


def test_all_is_sent_in_order_and_never_before_its_time():
    pacing = pacing_of(rate=0.2)
    pacing.start()
    pacing.play()
    assert pacing.outlet.numbers() == list(range(20))
    assert min(wall - batch.due for wall, batch in pacing.outlet.batches) >= 0.0
    assert pacing.finish().text.startswith("finished: 20 samples sent in 20 messages, rate 0.")
    assert pacing.outlet.states[-1] == (Mode.FINISHED, 20)


def test_while_it_waits_it_sleeps():
    pacing = pacing_of(n=6, rate=0.02)  # 50 ms from sample to sample
    pacing.start()
    before = time.thread_time()
    pacing.play()
    assert time.thread_time() - before < 0.05  # of 0.25 s


def test_what_has_no_room_waits_and_is_sent_when_it_has(playing):
    pacing = pacing_of(rate=1000.0, block=5)
    pacing.outlet.room = False
    pacing.start()
    playing(pacing)
    time.sleep(0.1)
    assert pacing.outlet.batches == []
    pacing.outlet.room = True
    wait_until(lambda: pacing.player.mode == Mode.FINISHED)
    assert pacing.outlet.numbers() == list(range(20))
    assert pacing.tally.worst_lateness > 0.09


def test_a_command_cuts_a_long_wait_short(playing):
    pacing = playing(pacing_of(n=4, period_ns=3_000_000_000_000), keep_alive=True)
    pacing.command(Player.resume)
    wait_until(lambda: pacing.outlet.numbers() == [0])
    begin = time.monotonic()
    assert pacing.send_at_once(Player.step, 2) == ("2 samples sent, the next is sample 3", 2)
    assert pacing.outlet.numbers() == [0, 1, 2]
    assert time.monotonic() - begin < PATIENCE  # most of an hour otherwise


def test_what_cannot_be_sent_at_once_is_answered_in_time(playing, monkeypatch):
    monkeypatch.setattr("crash_replay.pacing.ANSWER_WITHIN", 0.05)
    pacing = playing(pacing_of())
    pacing.outlet.room = False
    assert pacing.send_at_once(Player.burst, 7) == ("0 samples sent, 7 still to send, the next is sample 0", 0)
    pacing.outlet.room = True
    wait_until(lambda: pacing.outlet.numbers() == list(range(7)))


def test_the_state_is_reported_ten_times_a_second(playing):
    pacing = playing(pacing_of())
    pacing.start(paused=True)
    wait_until(lambda: (Mode.PAUSED, 0) in pacing.outlet.states)
    begin, count = time.monotonic(), len(pacing.outlet.states)
    wait_until(lambda: len(pacing.outlet.states) >= count + 4)
    assert time.monotonic() - begin > 0.25  # 0.3 to 0.4 s


def test_a_change_of_the_state_is_reported_at_once(playing, monkeypatch):
    monkeypatch.setattr("crash_replay.pacing.STATE_PERIOD", 3600.0)
    pacing = playing(pacing_of())
    pacing.start(paused=True)
    wait_until(lambda: pacing.outlet.states[-1:] == [(Mode.PAUSED, 0)])
    pacing.send_at_once(Player.burst, 3)
    wait_until(lambda: pacing.outlet.states[-1] == (Mode.PAUSED, 3))


def test_the_block_follows_the_rate():
    pacing = pacing_of(period_ns=100_000, block=0)
    assert pacing.block == 25
    pacing.command(Player.set_rate, 0.1)
    assert pacing.block == 1
    assert pacing_of(period_ns=100_000, block=3).block == 3


def test_it_waits_for_as_many_subscribers_as_were_asked_for():
    pacing = pacing_of(outlet=Outlet(subscribers=1))
    begin = time.monotonic()
    pacing.wait_for_subscribers(1, 10.0 * PATIENCE)
    assert time.monotonic() - begin < PATIENCE
    with pytest.raises(SubscribersMissing, match=r"only 1 of 2 .* after 0.1 s \(there: node0\): start the others, or"):
        pacing.wait_for_subscribers(2, 0.1)


def test_a_command_ends_the_waiting(playing):
    pacing = pacing_of()
    pacing.command(Player.pause)
    pacing.wait_for_subscribers(2, 1000.0)
    pacing.start()
    assert pacing.player.mode == Mode.PAUSED  # the command stands


def test_a_command_does_not_let_samples_overtake_the_test():
    """Whoever gets samples before the test they are of cannot do anything with them; but nobody is waited for long."""
    pacing = pacing_of()
    pacing.outlet.arrived = False
    Timer(0.1, lambda: setattr(pacing.outlet, "arrived", True)).start()
    pacing.command(Player.resume)
    pacing.wait_for_subscribers(2, 1000.0)
    assert pacing.outlet.arrived
    pacing.outlet.arrived = False
    begin = time.monotonic()
    pacing.wait_for_subscribers(2, 1000.0)
    assert time.monotonic() - begin < PATIENCE  # of 1000 s


def test_a_signal_ends_it_between_two_messages():
    pacing = pacing_of(rate=0.01)  # 0.1 s from sample to sample
    pacing.start()
    Timer(0.15, lambda: setattr(pacing, "stopped", True)).start()
    pacing.play()
    line = pacing.finish().text
    assert 1 <= len(pacing.outlet.numbers()) < 20
    assert line.startswith(f"stopped before sample {len(pacing.outlet.numbers())} of 20: ")


def test_it_says_what_has_not_arrived(monkeypatch):
    monkeypatch.setattr("crash_replay.pacing.LAST_ACKNOWLEDGEMENT", 0.05)
    pacing = pacing_of()
    pacing.outlet.arrived = False
    assert pacing.finish().text.endswith("ms late; a subscriber has not taken all of them")


def finished_pacing() -> Pacing:
    pacing = pacing_of(n=3, rate=1000.0)
    pacing.start()
    pacing.play()
    return pacing


def test_it_stays_at_the_end_until_all_who_take_part_have_all():
    pacing = finished_pacing()
    audience = pacing.audience
    audience.lack["/slow"] = "1 of 3 samples (stopped for 6 s)"
    Timer(0.3, audience.lack.clear).start()
    began = time.monotonic()
    assert pacing.finish(timeout=PATIENCE).lacking == []
    assert 0.25 < time.monotonic() - began < PATIENCE


def test_who_lacks_something_at_the_end_is_said_and_not_waited_for_without_end():
    pacing = finished_pacing()
    pacing.audience.lack["/slow"] = "1 of 3 samples (stopped for 6 s)"
    pacing.audience.lost["/dead"] = "2 of 3 samples (was killed)"
    outcome = pacing.finish(timeout=2.3)
    assert outcome.lacking == ["/slow has 1 of 3 samples (stopped for 6 s)", "/dead has 2 of 3 samples (was killed)"]
    (warning,) = pacing.audience.warnings
    assert warning.startswith("waiting up to 0 s for who lacks samples: /slow has 1 of 3 samples (stopped for 6 s)")


def test_a_node_asked_for_by_name_is_waited_for_until_it_is_ready():
    pacing = pacing_of()
    pacing.audience.preparing.append("diagnosis")
    with pytest.raises(SubscribersMissing, match="after 0.2 s not ready: diagnosis .on samples: node0.: start them"):
        pacing.wait_for_subscribers(1, 0.2, ["estimator", "diagnosis"])
    Timer(0.2, pacing.audience.preparing.clear).start()
    pacing.wait_for_subscribers(1, PATIENCE, ["estimator", "diagnosis"])
