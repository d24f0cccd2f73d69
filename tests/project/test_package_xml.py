"""What a package imports stands in its package.xml: as a key of rosdep, or as what pip is to install."""

import ast
import re
import sys

import pytest
from helpers_paths import ROOT

SOURCES = ROOT / "ros2_ws" / "src"
BESIDES = {"filterpy", "lz4", "zstandard", "setuptools", "rerun_cli", "markupsafe", "urllib3"}
"""Only measured against; what mcap brings along; for setup.py alone; of rerun-sdk; of jinja2; of requests."""
NAMED = {"rerun": "rerun-sdk", "ruamel": "ruamel.yaml"}


def imported(package: str) -> set[str]:
    """Names of the packages that its modules and launch files import, but for Python's own and itself."""
    found = set()
    for file in (SOURCES / package).rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                found.add(node.module.partition(".")[0])
    return {NAMED.get(name, name) for name in found - set(sys.stdlib_module_names) - BESIDES - {package}}


@pytest.mark.parametrize("package", ["crash_replay", "crash_estimator"])
def test_what_is_imported_is_asked_for(package):
    text = (SOURCES / package / "package.xml").read_text(encoding="utf-8")
    keys = {key.removeprefix("python3-") for key in re.findall(r"<exec_depend>(.+?)</exec_depend>", text)}
    by_pip = re.search(r"pip install ([^>]+?) -->", text)[1].split()
    assert imported(package) - keys - set(by_pip) == set()
