"""The commands of the README."""

import os
import re

import pytest
from helpers_domain import own_domain
from helpers_paths import DATA, ROOT

README = (ROOT / "README.md").read_text()
BLOCKS = [[line for line in block.splitlines() if line] for block in re.findall(r"```sh\n(.*?)```", README, re.S)]
COMMANDS = [line for block in BLOCKS for line in block]
(EXAMPLE,) = [block for block in BLOCKS if any("crash_examples" in line for line in block)]
"""Estimator, example and replay in three terminals."""


FETCHED = {"nhtsa:10146": DATA / "nhtsa-10146"}
"""Tests of NHTSA's database that a command names, and the folder that stands in for what the database would send."""


def environment() -> dict[str, str]:
    """Of a new user without a display, on a ROS domain of the test's own, to whom the tests of NHTSA's database that
    the README names have come already."""
    cache = ROOT / "out" / "cache"
    for source, folder in FETCHED.items():
        place = cache / f"v{source.removeprefix('nhtsa:')}"
        if folder.is_dir() and not place.is_dir():
            cache.mkdir(parents=True, exist_ok=True)
            place.unlink(missing_ok=True)
            place.symlink_to(folder.resolve(), target_is_directory=True)
    kept = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY", "MAKEFLAGS", "MAKELEVEL")}
    return kept | {"ROS_DOMAIN_ID": str(own_domain()), "CRASH_CACHE": str(cache)}


def needs_data(command: str) -> None:
    for source, folder in FETCHED.items():
        if source in command and not folder.is_dir():
            pytest.skip(f"{folder} is not there: {command} would ask NHTSA's database")
