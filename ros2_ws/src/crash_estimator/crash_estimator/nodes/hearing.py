"""Subscriptions that nothing can kill: what does not decode, or is at fault, is left out with a line."""

from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

from crash_replay.complaints import Complaints
from crash_replay.recording import RecordingError
from crash_replay.ros_messages import decoded


def hear(
    node: Node,
    complaints: Complaints,
    kind: type,
    topic: str,
    take: Callable[[Any], None],
    profile: QoSProfile,
    decode: Callable[[bytes], Any] | None = None,
) -> Subscription:
    """take: called with each message, may raise RecordingError; decode: its bytes -> what `take` gets.

    The bytes come as they are: rclpy's own decoding raises where nobody can catch it, and ends the node.
    """
    decode = decode or partial(decoded, kind=kind)

    def on_message(raw: bytes) -> None:
        try:
            take(decode(raw))
        except RecordingError as error:
            complaints.complain(topic, f"topic {topic}: {error}: left out")

    return node.create_subscription(kind, topic, on_message, profile, raw=True)
