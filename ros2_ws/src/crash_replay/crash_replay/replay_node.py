"""The node of `replay`: a recording is published as its clockwork says; `replay_command` says with what."""

import math
import signal
import sys
from collections.abc import Callable, Sequence
from functools import partial
from threading import Thread
from typing import Any, TypeVar

import rclpy
from crash_msgs.srv import Burst, Seek, SetRate, Step
from rclpy.exceptions import ParameterException
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from std_srvs.srv import Trigger

from .console import Console, wanted
from .fault import guarded, tell
from .health import HealthReport
from .middleware import prepare_middleware
from .node_parameters import declare_parameters, follow_changes, names_in
from .pacing import Outcome, Pacing
from .player import SECOND, CommandError, Player
from .readers import read_source
from .replay_health import replay_health
from .replay_parameters import PARAMETERS, window_of
from .replay_topics import ReplayTopics
from .ros_runtime import spin
from .rosbag2_services import serve_as_rosbag2
from .said import say
from .samples_again import serve_samples
from .selection import samples_within, select_channels

Other = TypeVar("Other", bound=Node)

TRIGGERS = {
    "pause": Player.pause,
    "resume": Player.resume,
    "toggle": Player.toggle,
    "toggle_paused": Player.toggle,  # as rosbag2 calls it
}


class ReplayNode(Node):
    """The replay's parameters, topics and services; `pacing` does what they ask for."""

    def __init__(self, **options) -> None:
        """options: of rclpy's Node."""
        super().__init__("replay", automatically_declare_parameters_from_overrides=True, **options)
        self.asked = declare_parameters(self, PARAMETERS)
        asked = self.asked
        self.outcome: Outcome | None = None  # when it is over
        self.then = names_in(asked["then"])
        for source in self.then:
            read_source(source)  # what is wrong with it is said now, not when its turn has come
        chosen = names_in(asked["channels"]), names_in(asked["exclude"]), asked["regex"], asked["exclude_regex"]
        recording = select_channels(read_source(asked["bag"]), *chosen)
        window = samples_within(window_of(asked), recording.time_ns)
        player = Player(recording.time_ns, asked["rate"], asked["loop"], *window)
        self.topics = topics = ReplayTopics(
            self, recording, asked["clock"], asked["answer_timeout"] if asked["lockstep"] else None
        )
        self.pacing = Pacing(recording, player, topics, self.asked["block"])
        for name, command in TRIGGERS.items():
            self.create_service(Trigger, f"~/{name}", self._on_trigger(command))
        serve_as_rosbag2(self, asked["rosbag2_services"])
        self.create_service(Step, "~/step", self._on_step)
        self.create_service(Seek, "~/seek", self._on_seek)
        self.create_service(SetRate, "~/set_rate", self._on_set_rate)
        self.create_service(Burst, "~/burst", self._on_burst)
        serve_samples(self, recording)
        HealthReport(self, "pace", partial(replay_health, self.pacing, topics.audience))
        follow_changes(self, PARAMETERS, self._change)

    def replay(self) -> Outcome:
        """All of it, in the calling thread."""
        keyboard, progress = (wanted(self.asked[k], s) for k, s in (("keyboard", sys.stdin), ("progress", sys.stderr)))
        with Console(self.pacing, self.set, keyboard, progress):
            names = names_in(self.asked["listeners"])
            self.pacing.wait_for_subscribers(self.asked["wait_for"], self.asked["wait_timeout"], names)
            self.pacing.start(self.asked["start_paused"], self.asked["delay"])
            self.pacing.play(self.asked["keep_alive"] and not self.then)
            self.outcome = self.pacing.finish(self.asked["finish_timeout"])
        return self.outcome

    def was_stopped(self) -> bool:
        """By a signal, a key or the service, and not by the recording's end."""
        return self.pacing.stopped or self.outcome is None or self.outcome.stopped

    def set(self, values: dict[str, Any]) -> str:
        """Set parameters together; why not, or nothing."""
        result = self.set_parameters_atomically([Parameter(name, value=value) for name, value in values.items()])
        return "" if result.successful else result.reason

    def _on_trigger(self, command: Callable) -> Callable:
        def serve(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
            self.pacing.command(command)
            player = self.pacing.player
            response.success = True
            response.message = f"{player.mode.name.lower()}, the next is sample {player.next}"
            return response

        return serve

    def _on_step(self, request: Step.Request, response: Step.Response) -> Step.Response:
        try:
            response.message, _ = self.pacing.send_at_once(Player.step, request.n)
            response.success = True
        except CommandError as error:
            response.message = str(error)
        response.number = self.pacing.player.next
        return response

    def _on_burst(self, request: Burst.Request, response: Burst.Response) -> Burst.Response:
        try:
            response.message, response.sent = self.pacing.send_at_once(Player.burst, request.n)
            response.success = True
        except CommandError as error:
            response.message = str(error)
        return response

    def _on_seek(self, request: Seek.Request, response: Seek.Response) -> Seek.Response:
        try:
            if not math.isfinite(request.time):
                raise CommandError(f"time must be a number of seconds, got {request.time}")
            self.pacing.command(Player.seek, round(request.time * SECOND))
            response.success, response.message = True, f"the next is sample {self.pacing.player.next}"
        except CommandError as error:
            response.message = str(error)
        response.number = self.pacing.player.next
        return response

    def _on_set_rate(self, request: SetRate.Request, response: SetRate.Response) -> SetRate.Response:
        result = self.set_parameters([Parameter("rate", value=request.rate)])[0]
        response.success = result.successful
        response.message = f"rate {self.pacing.player.rate:g}" if result.successful else result.reason
        return response

    def _change(self, new: dict[str, Any]) -> None:
        """Raises SelectionError where the window has no sample."""
        asked = self.asked | new
        window = samples_within(window_of(asked), self.pacing.player.time_ns)
        self.asked = asked
        if "rate" in new:
            self.pacing.command(Player.set_rate, new["rate"])
        if "loop" in new:
            self.pacing.command(Player.set_loop, new["loop"])
        if new.keys() & {"from", "until"}:
            self.pacing.command(Player.set_window, *window)


def main() -> int:
    return guarded(replay_in_turn, also=(ParameterException,))


def replay_in_turn() -> int:
    """The recording and those after it, each by a node of its own -> exit status."""
    made: list[ReplayNode] = []

    def make(**given: Any) -> ReplayNode:
        overrides = [Parameter(name, value=value) for name, value in given.items()]
        made.append(ReplayNode(parameter_overrides=overrides))
        return made[-1]

    status = replay_beside(make=make)
    for k, source in enumerate(then := made[0].then, start=1):
        if made[-1].was_stopped():
            break
        status = max(status, replay_beside(make=partial(make, bag=source, then=then[k:] or [""])))
    return status


def replay_beside(
    make_others: Callable[[], Sequence[Other]] = tuple,
    make: Callable[[], ReplayNode] = ReplayNode,
    hear_out: Callable[[ReplayNode, Sequence[Other]], int] = lambda node, others: 0,
    arguments: Sequence[str] | None = None,
) -> int:
    """A replay, with other nodes in the same process, till it is over -> exit status.

    hear_out: what the others still have to do when the replay has gone, and the exit status for it; arguments: for all
    nodes, where it is not the command line.
    """
    prepare_middleware()
    # Ctrl-C must end the replay between two messages, not take the context away under it.
    rclpy.init(args=None if arguments is None else list(arguments), signal_handler_options=SignalHandlerOptions.NO)
    try:
        others = make_others()
        node = make()
    except BaseException:
        rclpy.shutdown()
        raise
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: setattr(node.pacing, "stopped", True))
    executor, done = EventsExecutor(), Future()
    nodes: list[Node] = [node, *others]
    for one in nodes:
        executor.add_node(one)
    services = Thread(target=spin, args=(executor, done))
    services.start()
    try:
        outcome = node.replay()
        say(outcome.text)
        for line in outcome.lacking:
            tell(f"incomplete: {line}")
        node.topics.audience.leave()
        return max(1 if outcome.lacking else 0, hear_out(node, others))
    finally:
        node.topics.audience.leave()
        done.set_result(None)
        executor.wake()
        services.join()
        executor.shutdown()
        for one in nodes:
            one.destroy_node()
        rclpy.shutdown()


if __name__ == "__main__":
    sys.exit(main())
