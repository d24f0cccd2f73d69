"""The commands of the README."""

import os
import re

import pytest
from helpers_domain import own_domain
from helpers_paths import ROOT

README = (ROOT / "README.md").read_text()
COMMANDS = [line for block in re.findall(r"```sh\n(.*?)```", README, re.S) for line in block.splitlines() if line]


def environment() -> dict[str, str]:
    """Of a new user without a display, on a ROS domain of the test's own."""
    kept = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY", "MAKEFLAGS", "MAKELEVEL")}
    return kept | {"ROS_DOMAIN_ID": str(own_domain())}


def needs_data(command: str) -> None:
    for word in re.findall(r"\.\./shared/data/\S+", command):
        if not (ROOT / word).exists():
            pytest.skip(f"{word} is not beside the project")
