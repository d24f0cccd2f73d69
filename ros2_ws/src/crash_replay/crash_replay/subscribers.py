"""Who a reliable publisher waits for. The middleware does not tell, but has all who subscribe, and their processes."""

import os
from collections.abc import Sequence, Set

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import ReliabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo

from .obituary import announce_end
from .processes import PROCESSES, has_ended

UNNAMED = "_NODE_NAME_UNKNOWN_"
"""As rcl calls the node of a publisher or subscription that was found before its node was."""
HOST, PROCESS = slice(2, 4), slice(4, 6)
"""Of a GUID of Fast DDS: a number for the machine, and the last 16 bits of the process's number."""


def process_of(endpoint: TopicEndpointInfo) -> bytes:
    """The participant that a publisher or subscription is of: the first 12 bytes of its GUID (RTPS 2.2, 8.2.4.2)."""
    return bytes(endpoint.endpoint_gid[:12])


def node_name(endpoint: TopicEndpointInfo) -> str:
    return f"{endpoint.node_namespace.rstrip('/')}/{endpoint.node_name}"


def waited_for(node: Node, publishers: Sequence[Publisher]) -> str:
    """Those who may owe the node's publishers an acknowledgement; of these the killed ones, where there are any."""
    topics = {publisher.topic_name for publisher in publishers}
    listening = [e for topic in topics for e in node.get_subscriptions_info_by_topic(topic)]
    gone = sorted({_said(e) for topic in topics for e in killed(node, topic) if _acknowledges(e)})
    if gone:
        return f"{', '.join(gone)}, which was killed"
    names = sorted({_said(e) for e in listening if _acknowledges(e)})
    return names[0] if len(names) == 1 else f"one of {', '.join(names) or 'those that have just gone'}"


def killed(node: Node, topic: str) -> list[TopicEndpointInfo]:
    """Subscriptions on a topic of the node's that the middleware has yet to forget: their processes run no more.

    It is told so.
    """
    own = [process_of(e) for e in node.get_publishers_info_by_topic(topic)]
    listening = node.get_subscriptions_info_by_topic(topic)
    processes = running({process_of(e)[PROCESS] for e in listening})
    gone = [e for e in listening if is_gone(process_of(e), own, processes)]
    for participant in {process_of(e) for e in gone}:
        announce_end(participant, node.context.get_domain_id())
    return gone


def _acknowledges(endpoint: TopicEndpointInfo) -> bool:
    return endpoint.qos_profile.reliability == ReliabilityPolicy.RELIABLE


def _said(endpoint: TopicEndpointInfo) -> str:
    return "a node not known by name" if endpoint.node_name == UNNAMED else node_name(endpoint)


def is_gone(participant: bytes, own: Sequence[bytes], processes: Set[bytes]) -> bool:
    """Whether it was of a process of this machine that runs no more; False where that cannot be known.

    own: participants on the node's topics, this process's among them unless the middleware numbers them otherwise;
    processes: `running` of the participant's.
    """
    here = {one[HOST] for one in own if one[PROCESS] == _last_bits(os.getpid())}
    return participant[HOST] in here and participant[PROCESS] not in processes


def running(looked_for: Set[bytes]) -> Set[bytes]:
    """Those of these last 16 bits of numbers of processes that one which runs has; all where the system tells nothing.

    A replay that waits asks again and again: of the many processes only these are looked at.
    """
    if not looked_for or not PROCESSES.is_dir():
        return looked_for
    numbers = [int(name) for name in os.listdir(PROCESSES) if name.isdecimal()]
    return {_last_bits(n) for n in numbers if _last_bits(n) in looked_for and not has_ended(n)}


def _last_bits(process: int) -> bytes:
    return (process & 0xFFFF).to_bytes(2, "little")
