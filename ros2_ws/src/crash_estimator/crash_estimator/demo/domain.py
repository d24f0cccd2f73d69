"""A ROS domain that nobody on this machine uses: neither another demonstration nor whatever else runs here."""

import os
import random
import socket
from collections.abc import Sequence

DOMAINS = range(1, 102)
"""Those whose ports stay below Linux's ephemeral ones; 0 is everybody's default."""


def free_domain(among: Sequence[int] = DOMAINS) -> int:
    """A domain without a participant on this machine, drawn at random so that two that start at once do not meet."""
    candidates = random.SystemRandom().sample(among, len(among))
    return next((domain for domain in candidates if _is_free(domain)), candidates[0])


def _is_free(domain: int) -> bool:
    """Whether the first participant's discovery port is free (DDS-RTPS 9.6.1.1: 7400 + 250 domain + 10)."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("0.0.0.0", 7400 + 250 * domain + 10))
        except OSError:
            return False
    return True


def own_environment() -> dict[str, str]:
    """The environment of what is started: a domain of its own unless one is set."""
    return {"ROS_DOMAIN_ID": str(free_domain())} | os.environ
