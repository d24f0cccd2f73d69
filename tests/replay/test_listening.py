"""When `record` takes what it has found for all there is to find: the samples come last. No ROS graph here."""

import time
from types import SimpleNamespace

import pytest

from crash_replay.listening import SETTLED, TO_COME_WITHIN, Listening
from crash_replay.recorded_topics import SAMPLES, Choice
from crash_replay.recorder import Heard

NODE = SimpleNamespace(resolve_topic_name="/{}".format)


@pytest.mark.parametrize(
    ("quiet", "more_to_come", "settled"),
    [
        (0.5 * SETTLED, False, False),
        (2.0 * SETTLED, False, True),
        (2.0 * SETTLED, True, False),  # a channel that the test names has not been found
        (TO_COME_WITHIN + 1.0, True, True),  # who has said so may be a recording, of which nothing more comes
    ],
)
def test_samples_are_waited_with_until_all_that_is_known_of_is_found(quiet, more_to_come, settled):
    listening = Listening(NODE, Choice(), 0, print, lambda: more_to_come)
    listening.newest = time.monotonic() - quiet
    assert listening.settled() == settled


def test_a_while_in_which_it_got_no_processor_is_not_quiet():
    node = SimpleNamespace(get_topic_names_and_types=list)
    listening = Listening(node, Choice(), 0, print)
    listening.newest = time.monotonic() - 10.0 * SETTLED
    listening.looked = listening.newest
    listening.look()
    assert not listening.settled()
    time.sleep(SETTLED)
    assert listening.settled()


@pytest.mark.parametrize("more_to_come", [False, True])
def test_it_is_ready_when_it_hears_the_samples_and_nothing_more_is_to_come(more_to_come):
    listening = Listening(NODE, Choice(), 0, print, lambda: more_to_come)
    listening.newest = time.monotonic()
    assert not listening.ready()
    listening.heard["/samples"] = Heard("/samples", SAMPLES, latched=False)
    assert listening.ready() != more_to_come
