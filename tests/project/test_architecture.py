"""Imports run one way: the core knows neither ROS nor the viewer, and the replay does not know the estimator.

And what has one place in the packages is nowhere else.
"""

import re

import pytest
from helpers_modules import modules_after
from helpers_paths import PACKAGES

from crash_estimator.benchmarks.speed_start import commands


def test_the_core_imports_neither_ros_nor_the_viewer():
    statement = (
        "import pkgutil, importlib, crash_estimator.core as core; "
        "[importlib.import_module(m.name) for m in pkgutil.walk_packages(core.__path__, core.__name__ + '.')]"
    )
    loaded = modules_after(statement)
    assert "crash_estimator.core.methods" in loaded
    assert not loaded & {"rclpy", "rerun", "crash_msgs", "rosbags", "pydantic", "crash_estimator.nodes"}


def test_following_a_test_needs_no_ros():
    loaded = modules_after(
        "import crash_estimator.following.follower, crash_estimator.following.alignment\n"
        "import crash_estimator.following.again"
    )
    assert "crash_estimator.kept" in loaded and not loaded & {"rclpy", "rerun", "crash_msgs"}


def test_recordings_bags_and_the_player_work_without_ros():
    loaded = modules_after(
        "import crash_replay.bag, crash_replay.readers, crash_replay.player\nimport crash_replay.conditioning"
    )
    assert not loaded & {"rclpy", "rerun", "crash_estimator"}


HEAVY = {"numba", "scipy.linalg", "scipy.special", "rclpy", "crash_msgs", "rerun", "matplotlib"}
"""What takes a tenth of a second or more to import."""


@pytest.mark.parametrize("name", commands())
def test_help_needs_nothing_that_takes_long_to_import(name):
    module = commands()[name]
    loaded = modules_after(
        f"sys.argv[1:] = ['--help']\nfrom {module} import main\ntry: main()\nexcept SystemExit: pass\nsys"
    )
    assert module in loaded and not loaded & HEAVY


@pytest.mark.parametrize(
    "module, needless",
    [
        ("crash_estimator.demo.run", {"numba", "rerun", "scipy.special"}),
        ("crash_estimator.nodes.viewer_node", {"numba", "scipy.special"}),
        ("crash_estimator.nodes.diagnosis_answerer", {"scipy.signal", "scipy.stats", "scipy.interpolate", "rclpy"}),
    ],
)
def test_a_process_starts_without_what_it_has_no_use_for(module, needless):
    """Each of these takes as long to import as all the rest, in every process and every test that starts one."""
    loaded = modules_after(f"import {module}")
    assert module in loaded and not loaded & needless


EXAMPLE = "air_bag_trigger.py"
"""Written as by another author, who has none of our Python."""


def sources_with(pattern: str, *but: str) -> list[str]:
    """Places in the packages where the pattern stands, outside these files."""
    files = [file for file in PACKAGES.rglob("*.py") if file.name not in but]
    lines = ((file, n, line) for file in files for n, line in enumerate(file.read_text().splitlines(), 1))
    return [f"{file.relative_to(PACKAGES)}:{n}" for file, n, line in lines if re.search(pattern, line)]


def test_one_place_prints():
    """What is printed goes through `say` or `tell`, which show foreign text and tell of a full disk."""
    elsewhere = ("speed.py", EXAMPLE)  # the benchmark's progress: its own words, on standard error
    assert sources_with(r"(?<![\w.])print\(", "said.py", "fault.py", *elsewhere) == []


def test_one_place_writes_files():
    """Whole or not at all: by `output`; the others write what is streamed, appended to, or in a scratch folder."""
    streamed = ("bag_writer.py", "sinks.py", "children.py", "said.py", "effects_results.py", "scheduling.py")
    fetched = ("polite_client.py", "package.py", "by_number.py")  # goes on where it was, in the cache
    trials = ("members.py", "results.py", "worker.py", "live.py", "command.py", "__main__.py")  # logs, inputs, rows
    scratch = ("report_page.py", "page_markdown.py", "speed_recordings.py", "effects_judge.py")
    writing = r"\.write_(text|bytes)\(|open\([^)]*[\"'][wax]b?\+?[\"']"
    assert sources_with(writing, "output.py", *streamed, *fetched, *trials, *scratch) == []


def test_every_main_is_guarded():
    unguarded = ("warm_up.py", "diagnosis_answerer.py", "speed_relay.py", EXAMPLE)  # started by others of ours
    mains = [file for file in PACKAGES.rglob("*.py") if file.name not in unguarded and "def main(" in file.read_text()]
    assert len(mains) > 10
    assert [
        file.name for file in mains if not re.search(r"guarded\(|return (run|node_program)\(", file.read_text())
    ] == []


DIAGNOSIS = PACKAGES / "crash_estimator" / "crash_estimator" / "core" / "diagnosis"
FLOORS = (
    "observation", "parameterization", "mechanics", "output_error", "residuals", "selection", "report", "online",
)  # fmt: skip


def test_the_diagnosis_imports_go_one_way():
    """A package of the diagnosis imports from those before it alone."""
    assert {path.name for path in DIAGNOSIS.iterdir() if (path / "__init__.py").exists()} == set(FLOORS)
    upward = [
        f"{file.relative_to(DIAGNOSIS)} imports {other}"
        for floor, name in enumerate(FLOORS)
        for file in (DIAGNOSIS / name).glob("*.py")
        for other in re.findall(r"^\s*from \.\.(\w+)", file.read_text(), re.MULTILINE)
        if other not in FLOORS[:floor]
    ]
    assert upward == []


def test_only_the_public_face_of_the_diagnosis_is_imported_from_outside():
    files = [file for file in PACKAGES.rglob("*.py") if DIAGNOSIS not in file.parents]
    inside = re.compile(r"^(from|import) \S*\bdiagnosis\.\w", re.MULTILINE)  # indented ones are for type checkers alone
    deep = [str(file) for file in files if inside.search(file.read_text())]
    assert deep == []
