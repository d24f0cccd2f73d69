"""What a node needs of rclpy and the middleware beside its topics."""

import os
from pathlib import Path

from rclpy.executors import Executor
from rclpy.task import Future

PROFILES = Path(__file__).with_name("fastdds.xml")
PROFILES_VARIABLE = "FASTRTPS_DEFAULT_PROFILES_FILE"


def acknowledge_promptly() -> None:
    """Let Fast DDS notice and repair a lost message within some 10 ms; before rclpy.init, a user's own profiles win."""
    if not os.environ.get("FASTDDS_DEFAULT_PROFILES_FILE"):
        os.environ.setdefault(PROFILES_VARIABLE, str(PROFILES))


def spin(executor: Executor, until: Future) -> None:
    """Run callbacks until the future is done.

    In its place: EventsExecutor.spin() without a time-out keeps a core busy and hardly gets to its callbacks
    (rclpy 7.1: its deadline "never" overflows and is always past).
    """
    while not until.done():
        executor.spin_until_future_complete(until, timeout_sec=3600.0)
