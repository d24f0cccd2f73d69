"""What tests of the replay begin with: its recording as a bag, and who listens to it."""

import pytest


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """`some_recording()`: 40 samples at 1 kHz, the impact at number 10."""
    from helpers_replay import some_recording

    from crash_replay.bag import write_bag

    return write_bag(some_recording(), tmp_path_factory.mktemp("bags") / "some.mcap")


@pytest.fixture
def listener():
    from helpers_replay import Listener

    with Listener() as listener:
        yield listener
