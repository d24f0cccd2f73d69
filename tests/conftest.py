"""What holds for all tests, and what tests of several files begin with.

The imports are in the fixtures: what needs neither ROS nor the viewer does not wait for them.
"""

import os
import signal
import sys
from collections import Counter
from unittest.mock import patch

import pytest
from helpers_graph import NEEDS_A_GRAPH
from hypothesis import settings

# an example that takes long does so because the other test process, or somebody else, has the processor
settings.register_profile("no_deadline", deadline=None)
settings.load_profile("no_deadline")

# a shell that starts the tests in the background, or nohup, has them ignored, and what the tests start inherits that
for ending in (signal.SIGINT, signal.SIGHUP):
    if signal.getsignal(ending) is signal.SIG_IGN:
        signal.signal(ending, signal.default_int_handler if ending is signal.SIGINT else signal.SIG_DFL)


def pytest_addoption(parser):
    parser.addoption("--no-graph", action="store_true", help="leave out the files that start nodes or processes")


def pytest_ignore_collect(collection_path, config):
    if config.getoption("--no-graph") and collection_path.suffix == ".py":
        return True if NEEDS_A_GRAPH.search(collection_path.read_text()) else None
    return None


LONGEST = (
    "test_demo.py", "test_thesis.py", "test_coverage.py", "test_demo_search.py", "test_readme_demo.py",
    "test_viewer_revisions.py",
)  # fmt: skip
"""Files of tests that take a minute or more, to be begun first: one that is begun last is waited for alone."""


def pytest_collection_modifyitems(items):
    """Files of many tests come next: of two processes that share them out neither waits long for the other."""
    files = Counter(item.path for item in items)
    rank = {path: LONGEST.index(path.name) if path.name in LONGEST else len(LONGEST) for path in files}
    items.sort(key=lambda item: (rank[item.path], -files[item.path]))


@pytest.fixture
def node_ended(monkeypatch, capfd):
    """node_ended(main, *arguments) -> exit status, output and errors of a program that cannot begin its work.

    In this process: to start one takes more than all that it does, and one of each node is started in
    tests/project/test_parameters.py.
    """
    from helpers_domain import own_domain

    def end(main, *arguments) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", [main.__module__, *map(str, arguments)])
        handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
        try:
            with patch.dict(os.environ, {"ROS_DOMAIN_ID": str(own_domain())}):  # and all that a node adds to it
                status = main()
        finally:
            for number, handler in handlers.items():
                signal.signal(number, handler)
        return status, *capfd.readouterr()

    return end


@pytest.fixture
def stage():
    """Estimator nodes in this process, which end with the test."""
    from helpers_estimator_node import Stage

    stage = Stage()
    yield stage
    stage.close()


@pytest.fixture(scope="module")
def strict():
    """Rerun raises at bad input instead of warning of it."""
    import rerun as rr

    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


@pytest.fixture(scope="module")
def crash():
    from helpers_viewer import simulate

    return simulate()


@pytest.fixture(scope="module")
def streams(crash) -> dict[str, list]:
    """What two estimators say of the crash."""
    from helpers_viewer import two_streams

    return two_streams(crash)


@pytest.fixture(scope="module")
def cast(crash, streams):
    """All that is known of the two estimators."""
    from helpers_viewer import NAMES, test_block

    from crash_estimator.viewer.cast import Cast, member

    cast = Cast(test_block(crash), (crash.time_ns[0] * 1e-9, crash.time_ns[-1] * 1e-9))
    for name in NAMES:
        cast = cast.with_member(member(*streams[name][:3]))
    return cast


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """A model, of the text of its file."""
    from crash_estimator.model_file import load_model

    folder = tmp_path_factory.mktemp("models")

    def made(text: str):
        path = folder / f"{abs(hash(text))}.yaml"
        path.write_text(text)
        return load_model(path)

    return made
