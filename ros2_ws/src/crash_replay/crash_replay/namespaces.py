"""What is whose where several replays share a graph, each with its nodes in a namespace of its own."""

from rclpy.node import Node


def is_own(node: Node, topic: str) -> bool:
    """Whether a topic is of the node's namespace: a node in it publishes there, or one without a namespace into it.

    The latter is what rosbag2's player does, whose topics are remapped one by one. A topic's name alone does not tell:
    to a node without a namespace every topic would be its own.
    """
    namespace = node.get_namespace()
    publishers = {info.node_namespace for info in node.get_publishers_info_by_topic(topic)}
    return namespace in publishers or (publishers == {"/"} and topic.startswith(f"{namespace}/"))


def namespace_of(node_name: str) -> str:
    """Of a node's full name, with the first slash or, as on `/diagnostics`, without: "sled_a/replay" -> "/sled_a"."""
    return "/" + node_name.lstrip("/").rpartition("/")[0]
