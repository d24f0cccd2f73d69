"""What rosbag2's player offers as services, beside the replay's own.

`~/play_next`, `~/is_paused`, `~/get_rate` and `~/stop` are std_srvs/Trigger, as `~/pause` and `~/resume` are. Scripts
and panels that were made for `ros2 bag play` call `/rosbag2_player/pause` and so on, with types of rosbag2's own: these
are served too, below `rosbag2_player` in the replay's namespace, where that is asked for.
"""

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any

from std_srvs.srv import Trigger

from .node_parameters import ParameterError
from .player import CommandError, Mode, Player
from .ros_messages import stamp_ns

if TYPE_CHECKING:
    from .replay_node import ReplayNode

PLAYER = "rosbag2_player"
PACKAGE = "rosbag2_interfaces"


def serve_as_rosbag2(node: "ReplayNode", with_its_types: bool) -> None:
    """Raises ParameterError where its types are not installed."""
    services = Services(node)
    for name in ("play_next", "is_paused", "get_rate", "stop"):
        node.create_service(Trigger, f"~/{name}", getattr(services, name))
    if not with_its_types:
        return
    try:
        types = import_module(f"{PACKAGE}.srv")
    except ImportError:
        raise ParameterError(
            f"parameter rosbag2_services: there is no package {PACKAGE}: install it, or call the replay's own services"
        ) from None
    for kind, serve in as_its_types(services).items():
        name = "".join(f"_{c.lower()}" if c.isupper() else c for c in kind).lstrip("_")
        node.create_service(getattr(types, kind), f"{PLAYER}/{name}", serve)


class Services:
    """In the form of a Trigger."""

    def __init__(self, node: "ReplayNode"):
        self.node = node

    @property
    def paused(self) -> bool:
        return self.node.pacing.player.mode != Mode.PLAYING

    def play_next(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """One sample, as rosbag2 does: while paused only."""
        response.success, response.message = False, "it plays: pause it first"
        if self.paused:
            try:
                response.message, sent = self.node.pacing.send_at_once(Player.step, 1)
                response.success = sent > 0
            except CommandError as error:
                response.message = str(error)
        return response

    def is_paused(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """success: that it is."""
        response.success, response.message = self.paused, self.node.pacing.player.mode.name.lower()
        return response

    def get_rate(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = True, f"{self.node.pacing.player.rate:g}"
        return response

    def stop(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """The replay ends, as by Ctrl-C."""
        response.success, response.message = True, f"stopped before sample {self.node.pacing.player.next}"
        self.node.pacing.stopped = True
        return response


def as_its_types(services: Services) -> dict[str, Callable[[Any, Any], Any]]:
    """What serves a request of each of rosbag2_interfaces' types."""
    node = services.node
    pacing = node.pacing

    def commanded(command: Callable) -> Callable[[Any, Any], Any]:
        def serve(_, response):
            pacing.command(command)
            return response

        return serve

    def succeeds(command: Callable[[Any], bool]) -> Callable[[Any, Any], Any]:
        def serve(request, response):
            response.success = command(request)
            return response

        return serve

    def is_paused(_, response):
        response.paused = services.paused
        return response

    def get_rate(_, response):
        response.rate = pacing.player.rate
        return response

    def burst(request, response):
        try:
            _, response.actually_burst = pacing.send_at_once(Player.burst, request.num_messages)
        except CommandError as error:  # none is left: 0
            node.get_logger().warning(str(error))
        return response

    def seek(request) -> bool:
        try:
            pacing.command(Player.seek, stamp_ns(request.time) - node.topics.time_zero)
        except CommandError as error:
            node.get_logger().warning(str(error))
            return False
        return True

    def stop(_, response):
        services.stop(_, Trigger.Response())
        return response

    return {
        "Pause": commanded(Player.pause),
        "Resume": commanded(Player.resume),
        "TogglePaused": commanded(Player.toggle),
        "IsPaused": is_paused,
        "GetRate": get_rate,
        "SetRate": succeeds(lambda request: node.set({"rate": request.rate}) == ""),
        "PlayNext": succeeds(lambda request: services.play_next(request, Trigger.Response()).success),
        "Burst": burst,
        "Seek": succeeds(seek),
        "Stop": stop,
    }
