"""The ROS domains of this test process: the processes of a `make test` share all of them out and never meet."""

import os

from crash_estimator.demo.domain import DOMAINS, free_domain

WORKER = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
WORKERS = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
OWN_DOMAINS = DOMAINS[WORKER::WORKERS]


def own_domain() -> int:
    """One of them that is free: other people's nodes, and another `make test`, are not heard either."""
    return free_domain(OWN_DOMAINS)
