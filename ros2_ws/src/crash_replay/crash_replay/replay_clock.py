"""`/clock`: one for a whole graph, whatever the namespaces. So a replay publishes it only where it is alone with it."""

from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node, NodeNameNonExistentError
from rclpy.publisher import Publisher
from rclpy.topic_endpoint_info import TopicEndpointInfo
from rosgraph_msgs.msg import Clock

from .qos import STREAM
from .ros_messages import stamp
from .subscribers import UNNAMED, node_name

TOPIC = "/clock"


class ReplayClock:
    def __init__(self, node: Node, wanted: str):
        """wanted: "true", "false", or "auto": outside any namespace, while nobody else publishes it."""
        self.node, self.yields = node, wanted == "auto"
        self.heard: list[Publisher] = []  # the publisher, where somebody listens
        self.publisher: Publisher | None = None
        if wanted == "true" or (self.yields and node.get_namespace() == "/"):
            # without the events that the executor's thread would look at: it may be destroyed in another one
            no_events = PublisherEventCallbacks(use_default_callbacks=False)
            self.publisher = node.create_publisher(Clock, TOPIC, STREAM, event_callbacks=no_events)

    def tell(self, time_ns: int) -> None:
        """That it is so late now: before the samples of this time go out."""
        for publisher in self.heard:
            publisher.publish(Clock(clock=stamp(time_ns)))

    def look(self) -> None:
        """Whether somebody listens, and whether another node goes first."""
        if self.publisher and self.yields and (other := self._goes_first()):
            self.node.get_logger().warning(f"{other} publishes {TOPIC}: this replay does not; clock:=true makes it")
            self.node.destroy_publisher(self.publisher)
            self.publisher = None
        self.heard = [self.publisher] if self.publisher and self.publisher.get_subscription_count() else []

    def _goes_first(self) -> str:
        """Another node that keeps publishing it, or ""; of two replays the same one gives way for both.

        One whose name has not come yet is left for the next look: its own publisher may be seen before its node is.
        """
        publishers = [one for one in self.node.get_publishers_info_by_topic(TOPIC) if one.node_name != UNNAMED]
        name = self.node.get_fully_qualified_name()
        own = [info.endpoint_gid for info in publishers if node_name(info) == name]
        others = [info for info in publishers if node_name(info) != name]
        first = [one for one in others if own and (one.endpoint_gid < min(own) or not self._is_replay(one))]
        return node_name(first[0]) if first else ""

    def _is_replay(self, endpoint: TopicEndpointInfo) -> bool:
        try:
            topics = self.node.get_publisher_names_and_types_by_node(endpoint.node_name, endpoint.node_namespace)
        except NodeNameNonExistentError:  # it has just gone, or just come
            return True
        return any("crash_msgs/msg/ReplayState" in kinds for _, kinds in topics)
