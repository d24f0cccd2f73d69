"""Notices that the replay has sent more than has come, where nothing comes any more: after a process was stopped for
longer than the middleware keeps anything for it, no later sample may come that would show the gap."""

import time
from collections.abc import Callable

from crash_msgs.msg import ReplayState
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from crash_replay.attending import Attending

LOOK = 0.5
"""s between two looks."""
QUIET = 1.0
"""s without a sample after which what the replay has sent and has not come is not on its way any more."""

Place = tuple[int, int]
"""Run, and number of the next sample."""


class CatchingUp:
    def __init__(self, node: Node, attending: Attending, place: Callable[[], Place | None], ask: Callable):
        """place: what has come of the test; None: nothing is to be asked for now; ask: run, start, stop."""
        self.attending, self.place, self.ask = attending, place, ask
        self.came_at = self.looked_at = time.monotonic()
        node.create_timer(LOOK, self.look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def came(self) -> None:
        """A sample has come."""
        self.came_at = time.monotonic()

    def look(self) -> None:
        now = time.monotonic()
        if now - self.looked_at > 2 * LOOK:
            self.came_at = now  # this process was stopped itself: what waits for it comes first
        self.looked_at = now
        if now - self.came_at > QUIET:
            self.ask_at_once()

    def ask_at_once(self) -> None:
        """Ask for what is behind, if anything is."""
        place, state = self.place(), self.attending.replay_state
        wanted = behind(place, state) if place and state else None
        if wanted:
            self.ask(*wanted)


def behind(place: Place, state: ReplayState) -> tuple[int, int, int] | None:
    """Run and samples start, ..., stop - 1 that the replay has sent and that have not come; None: there are none."""
    run, number = place
    start = number if run == state.run else state.first
    return (state.run, start, state.number) if start < state.number else None
