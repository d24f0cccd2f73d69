"""How a test asks a service."""

import time
from collections.abc import Callable

from helpers_waiting import PATIENCE
from rclpy.node import Node

TRIES = 4
"""Times that a service is asked: on a busy machine one call of some hundred gets no answer."""


def ask(node: Node, kind: type, service: str, look: Callable[[], None], patience: float = PATIENCE, **request):
    """The answer of a service, asked again as a new client where none comes.

    look: called while waiting; the node's callbacks run in it, or in another thread.
    """

    def wait(done: Callable[[], bool], seconds: float) -> bool:
        limit = time.monotonic() + seconds
        while not done() and time.monotonic() < limit:
            look()
        return done()

    for _ in range(TRIES):
        client = node.create_client(kind, service)
        assert wait(client.service_is_ready, patience), f"waited {patience:g} s in vain for a service {service}"
        call = client.call_async(kind.Request(**request))
        answered = wait(call.done, patience / TRIES)
        node.destroy_client(client)
        if answered:
            return call.result()
    raise AssertionError(f"{service} was asked {TRIES} times in {patience:g} s and did not answer")
