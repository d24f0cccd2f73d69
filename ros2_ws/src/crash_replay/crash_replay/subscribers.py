"""Who a reliable publisher waits for. The middleware does not tell, but has all who subscribe, and their processes."""

import os
from collections.abc import Sequence
from pathlib import Path

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import ReliabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo

from .obituary import announce_end

UNNAMED = "_NODE_NAME_UNKNOWN_"
"""As rcl calls the node of a publisher or subscription that was found before its node was."""
PROCESSES = Path("/proc")
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
    processes = running()
    gone = [e for e in node.get_subscriptions_info_by_topic(topic) if is_gone(process_of(e), own, processes)]
    for participant in {process_of(e) for e in gone}:
        announce_end(participant, node.context.get_domain_id())
    return gone


def _acknowledges(endpoint: TopicEndpointInfo) -> bool:
    return endpoint.qos_profile.reliability == ReliabilityPolicy.RELIABLE


def _said(endpoint: TopicEndpointInfo) -> str:
    return "a node not known by name" if endpoint.node_name == UNNAMED else node_name(endpoint)


def is_gone(participant: bytes, own: Sequence[bytes], processes: set[bytes]) -> bool:
    """Whether it was of a process of this machine that runs no more; False where that cannot be known.

    own: participants on the node's topics, this process's among them unless the middleware numbers them otherwise.
    """
    here = {one[HOST] for one in own if one[PROCESS] == _last_bits(os.getpid())}
    return bool(processes) and participant[HOST] in here and participant[PROCESS] not in processes


def running() -> set[bytes]:
    """The last 16 bits of the numbers of all processes; none where the system does not list them."""
    return {_last_bits(int(folder.name)) for folder in PROCESSES.glob("[0-9]*") if not _has_ended(folder)}


def _has_ended(folder: Path) -> bool:
    """Its parent may not have taken note of it yet."""
    try:
        return (folder / "stat").read_text().rpartition(")")[2].split()[0] in "ZX"
    except OSError:
        return True


def _last_bits(process: int) -> bytes:
    return (process & 0xFFFF).to_bytes(2, "little")
