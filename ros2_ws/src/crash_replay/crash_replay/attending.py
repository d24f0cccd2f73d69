"""A node's part in the attendance: it says its own words, hears those of the others and how far the replay has come."""

import os
from collections.abc import Callable
from typing import NamedTuple

from crash_msgs.msg import Attendance as Message
from crash_msgs.msg import ReplayState
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.node import Node

from .attendance import PERIOD, Attendance, State, Word
from .foreign_text import visible
from .obituary import announce_end
from .processes import this_host
from .qos import EVERY_SAMPLE_SAID, LATCHED
from .subscribers import node_name, process_of

TOPIC = "attendance"
REPLAY = "replay"
"""The role of the node that sends the samples."""

HEARD = Duration(seconds=0.5)
"""For the others to take the last word."""


class Progress(NamedTuple):
    """What a node has to say of its work; see crash_msgs/Attendance."""

    run: int = 0
    total: int = 0
    next: int = 0
    missing: int = 0
    done: bool = False
    reason: str = ""
    ready: bool = True


class Attending:
    """Says a word of the node at each `tell` and every half second, and keeps the last words of all others."""

    def __init__(self, node: Node, role: str, progress: Callable[[], Progress]):
        """progress: asked for at each word; before the first it must answer."""
        self.node, self.progress = node, progress
        self.own = Word(node.get_fully_qualified_name(), role, this_host(), os.getpid())
        self.others = Attendance()
        self.replay_state: ReplayState | None = None
        self.buried: set[Word] = set()  # the last words of those whose end has been announced
        self.out = node.create_publisher(Message, TOPIC, LATCHED)
        node.create_subscription(Message, TOPIC, self._on_word, EVERY_SAMPLE_SAID)
        if role != REPLAY:
            node.create_subscription(ReplayState, "replay_state", self._on_state, LATCHED)
        # not by the node's own clock, which may be the replay's and stand still
        node.create_timer(PERIOD, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def tell(self) -> None:
        """Say how far the node is."""
        self.own = self.own._replace(**self.progress()._asdict())
        self.out.publish(Message(**self.own._asdict()))

    def _why_the_rest_has_not_come(self) -> str:
        for name in self.others.names(REPLAY):
            state = self.others.state(name)
            if state in (State.LEFT, State.KILLED, State.SILENT):
                return f"the replay {self.others.how(name, state)}"
        return "ended before the rest came"

    def _look(self) -> None:
        self.tell()
        self._bury_killed()

    def _bury_killed(self) -> None:
        """See to it that nobody waits for what a process that was killed has not taken."""
        killed = {name for name in self.others.names() if self.others.state(name) == State.KILLED}
        killed = {name for name in killed if self.others.word(name) not in self.buried}
        if not killed:
            return
        self.buried |= {self.others.word(name) for name in killed}
        for info in self.node.get_publishers_info_by_topic(TOPIC):
            if node_name(info) in killed:
                announce_end(process_of(info), self.node.context.get_domain_id())

    def leave(self) -> str:
        """The last word, as the node ends -> a line on what its results lack, or ""."""
        own = self.own = self.own._replace(**self.progress()._asdict(), leaving=True)
        self.out.publish(Message(**own._asdict()))
        self.out.wait_for_all_acked(HEARD)  # what is left unsaid makes others think that it was killed
        if not own.total or (own.done and not (own.missing or own.reason)):
            return ""
        why = own.reason or self._why_the_rest_has_not_come()
        if own.next >= own.total and not own.missing:
            return f"incomplete: no last word on all {own.total} samples ({why})"
        return f"incomplete: {own.next - own.missing} of {own.total} samples ({why})"

    def _on_word(self, message: Message) -> None:
        if message.node != self.own.node or message.process != self.own.process or message.host != self.own.host:
            said = (getattr(message, field) for field in Word._fields)
            self.others.hear(Word._make(visible(one) if isinstance(one, str) else one for one in said))

    def _on_state(self, message: ReplayState) -> None:
        self.replay_state = message

    def replay_is_there(self) -> bool | None:
        """Whether a replay takes part that has not ended; None where none has ever said a word."""
        replays = self.others.names(REPLAY)
        return any(self.others.there(name) for name in replays) if replays else None
