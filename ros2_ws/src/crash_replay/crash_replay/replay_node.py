"""The node of `replay`: a recording is published as its clockwork says; `replay_command` says with what."""

import math
import signal
import sys
from collections.abc import Callable
from functools import partial
from threading import Thread
from typing import Any

import rclpy
from crash_msgs.srv import Burst, Seek, SetRate, Step
from rcl_interfaces.msg import SetParametersResult
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
from .node_parameters import ParameterError, checked, declare_parameters, names_in
from .pacing import Outcome, Pacing
from .player import SECOND, CommandError, Player
from .readers import read_source
from .replay_command import LIVE, PARAMETERS, window_of
from .replay_health import replay_health
from .replay_topics import ReplayTopics
from .ros_runtime import spin
from .said import say
from .samples_again import serve_samples
from .selection import SelectionError, samples_within, select_channels


class ReplayNode(Node):
    """The replay's parameters, topics and services; `pacing` does what they ask for."""

    def __init__(self) -> None:
        super().__init__("replay", automatically_declare_parameters_from_overrides=True)
        self.asked = declare_parameters(self, PARAMETERS, LIVE)
        asked = self.asked
        recording = select_channels(read_source(asked["bag"]), names_in(asked["channels"]), names_in(asked["exclude"]))
        window = samples_within(window_of(asked), recording.time_ns)
        player = Player(recording.time_ns, asked["rate"], asked["loop"], *window)
        self.topics = topics = ReplayTopics(
            self, recording, asked["clock"], asked["answer_timeout"] if asked["lockstep"] else None
        )
        self.pacing = Pacing(recording, player, topics, self.asked["block"])
        for command in (Player.pause, Player.resume, Player.toggle):
            self.create_service(Trigger, f"~/{command.__name__}", self._on_trigger(command))
        self.create_service(Step, "~/step", self._on_step)
        self.create_service(Seek, "~/seek", self._on_seek)
        self.create_service(SetRate, "~/set_rate", self._on_set_rate)
        self.create_service(Burst, "~/burst", self._on_burst)
        serve_samples(self, recording)
        HealthReport(self, "pace", partial(replay_health, self.pacing, topics.audience))
        self.add_on_set_parameters_callback(self._on_parameters)

    def replay(self) -> Outcome:
        """All of it, in the calling thread."""
        keyboard, progress = (wanted(self.asked[k], s) for k, s in (("keyboard", sys.stdin), ("progress", sys.stderr)))
        with Console(self.pacing, self._set, keyboard, progress):
            names = names_in(self.asked["listeners"])
            self.pacing.wait_for_subscribers(self.asked["wait_for"], self.asked["wait_timeout"], names)
            self.pacing.start(self.asked["start_paused"], self.asked["delay"])
            self.pacing.play(self.asked["keep_alive"])
            return self.pacing.finish(self.asked["finish_timeout"])

    def _set(self, values: dict[str, Any]) -> str:
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

    def _on_parameters(self, parameters: list[Parameter]) -> SetParametersResult:
        """Follow a change of what may be changed at any time; nothing of it where one part cannot be."""
        try:
            new = {p.name: checked(PARAMETERS, p.name, p.value) for p in parameters if p.name in LIVE}
            asked = self.asked | new
            window = samples_within(window_of(asked), self.pacing.player.time_ns)
        except (ParameterError, SelectionError) as error:
            return SetParametersResult(successful=False, reason=str(error))
        self.asked = asked
        if "rate" in new:
            self.pacing.command(Player.set_rate, new["rate"])
        if "loop" in new:
            self.pacing.command(Player.set_loop, new["loop"])
        if new.keys() & {"from", "until"}:
            self.pacing.command(Player.set_window, *window)
        return SetParametersResult(successful=True)


def main() -> int:
    return guarded(_main, also=(ParameterException,))


def _main() -> int:
    prepare_middleware()
    # Ctrl-C must end the replay between two messages, not take the context away under it.
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = ReplayNode()
    except BaseException:
        rclpy.shutdown()
        raise
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: setattr(node.pacing, "stopped", True))
    executor, done = EventsExecutor(), Future()
    executor.add_node(node)
    services = Thread(target=spin, args=(executor, done))
    services.start()
    try:
        outcome = node.replay()
        say(outcome.text)
        for line in outcome.lacking:
            tell(f"incomplete: {line}")
        return 1 if outcome.lacking else 0
    finally:
        node.topics.audience.leave()
        done.set_result(None)
        executor.wake()
        services.join()
        executor.shutdown()
        node.destroy_node()
        rclpy.shutdown()


if __name__ == "__main__":
    sys.exit(main())
