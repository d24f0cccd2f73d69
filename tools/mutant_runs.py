"""Tests run in processes of their own, on the code as it is or changed: what `mutant_judges.py` learns and judges by.

Each is forked from this one, so that what takes long to import is imported once, but never the packages: a change is
made where a process imports them, the files stay as they are. What a test starts itself does not see it.
"""

import json
import os
import signal
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import suppress
from importlib import import_module
from importlib.machinery import SourceFileLoader
from multiprocessing import Value, get_context
from pathlib import Path

import coverage
import numba
import pytest

ROOT = Path(__file__).resolve().parent.parent
SOURCES, KEPT = ROOT / "ros2_ws" / "src", ROOT / "out" / "mutants"
PACKAGES = ("crash_estimator", "crash_replay")
AT_ONCE = 2  # processes that judge
SLOW, SLOW_FILE = 6.0, 20.0  # s: a test that takes longer judges nothing, nor one that is begun so late in its file
AMID_OTHERS = 3.0
"""So many times what it takes of a processor may a test last, and its judging: others use the processors too."""
BEFORE = "scipy.signal scipy.optimize scipy.linalg scipy.stats hypothesis yaml pydantic rclpy.node crash_msgs.msg"
"""What takes long to import, and is not changed."""


def file_of(test: str) -> str:
    return test.partition("::")[0]


class Watch:
    """What pytest tells of a run: which test executes which lines and how long it takes, and which fails."""

    def __init__(self, note: Path, limits: dict[str, float] | None = None, lines: coverage.Coverage | None = None):
        self.note, self.limits, self.lines, self.end = note, limits, lines, time.process_time() + SLOW_FILE
        self.took, self.shared, self.bad = Counter(), {}, []

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items):
        if self.limits is not None:
            order = {test: k for k, test in enumerate(self.limits)}
            items[:] = sorted((item for item in items if item.nodeid in order), key=lambda item: order[item.nodeid])

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_protocol(self, item):
        if self.limits is None and time.process_time() > self.end:
            item.session.shouldstop = "it takes too long to judge"
        self.shared[item.nodeid] = [f"{file_of(item.nodeid)} {name}" for name in item.fixturenames]
        self._count(item.nodeid)
        signal.signal(signal.SIGALRM, lambda *_: pytest.fail("too slow"))
        signal.setitimer(signal.ITIMER_REAL, (self.limits or {}).get(item.nodeid, AMID_OTHERS * SLOW))
        start = time.monotonic(), time.process_time()
        yield
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        lasted, used = time.monotonic() - start[0], time.process_time() - start[1]
        self.took[item.nodeid] = max(used, lasted / AMID_OTHERS)  # one that waits uses no processor

    @pytest.hookimpl(hookwrapper=True)
    def pytest_fixture_setup(self, fixturedef, request):
        if fixturedef.scope != "function":  # is made in the first test that asks for it, but of all that do
            self._count(f"{file_of(request._pyfuncitem.nodeid)} {fixturedef.argname}")
        yield
        self._count(request._pyfuncitem.nodeid)

    def _count(self, context: str) -> None:
        if self.lines:
            self.lines.switch_context(context)

    def pytest_runtest_logreport(self, report):
        if report.failed:
            self._failed(report.nodeid)

    def pytest_collectreport(self, report):
        if report.failed:
            self._failed(report.nodeid)

    def _failed(self, test: str) -> None:
        self.bad.append(test)
        if not self.lines:
            self.note.write_text(json.dumps(self.bad))  # at once: what comes after may be ended from outside

    def learnt(self) -> None:
        """Note of each test that passed how long it took and what it executed."""
        bits, data = defaultdict(Counter), self.lines.get_data()
        for path in data.measured_files():
            for line, contexts in data.contexts_by_lineno(path).items():
                for context in contexts:
                    bits[context][str(Path(path).relative_to(SOURCES))] |= 1 << line
        tests = {}
        for test in (test for test in self.took.keys() - set(self.bad) if self.took[test] < SLOW):
            lines = Counter(bits[test])
            for shared in self.shared[test]:
                for path, more in bits[shared].items():
                    lines[path] |= more
            tests[test] = self.took[test], {path: hex(mask) for path, mask in lines.items()}
        self.note.write_text(json.dumps(tests))


def forked(plain: bool, patience: float, work: Callable[[Path], None]):
    """What `work`, in a process of its own, has noted when it ends or must; with numba off if it is to be plain."""
    with tempfile.TemporaryDirectory() as folder:
        note = Path(folder) / "note.json"
        if not (child := os.fork()):
            with suppress(BaseException):
                os.setsid()
                for stream in range(3):
                    os.dup2(os.open(os.devnull, os.O_RDWR), stream)
                os.environ["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"
                if plain:
                    os.environ["NUMBA_DISABLE_JIT"], numba.config.DISABLE_JIT = "1", 1
                work(note)
            os._exit(0)
        end = time.monotonic() + patience
        while time.monotonic() < end and not os.waitpid(child, os.WNOHANG)[0]:
            time.sleep(0.02)
        with suppress(ProcessLookupError):
            os.killpg(child, signal.SIGKILL)
        with suppress(ChildProcessError):
            os.waitpid(child, 0)
        return json.loads(note.read_text()) if note.exists() else None


def change(path: Path, text: str) -> None:
    """Let this process, when it imports a file, find another text in it."""
    found = SourceFileLoader.get_code

    def get_code(loader: SourceFileLoader, name: str):
        if Path(loader.path).resolve() == path:
            return compile(text, loader.path, "exec")
        return found(loader, name)

    SourceFileLoader.get_code = get_code


def run_pytest(files: list[str], watch: Watch, *more: str) -> None:
    # assert=plain: else pytest itself imports what is called as a file of tests, such as band_test, and sees no change
    plain = ["-p", "_hypothesis_pytestplugin", "-p", "no:cacheprovider", "--assert=plain", "--hypothesis-seed=0"]
    pytest.main([*plain, "-q", "--tb=no", *more, *files], plugins=[watch])


def _begin(turn) -> None:
    with turn.get_lock():  # tests of nodes share out the ROS domains by it
        os.environ |= {"PYTEST_XDIST_WORKER": f"gw{turn.value % AT_ONCE}", "PYTEST_XDIST_WORKER_COUNT": str(AT_ONCE)}
        turn.value += 1


def shared_out(work: Callable, things: list) -> Iterator:
    """What `work` gives for each, by as many processes as judge at once, in the order in which they are through."""
    for name in BEFORE.split():
        import_module(name)
    with ProcessPoolExecutor(AT_ONCE, get_context("fork"), _begin, (Value("i", 0),)) as pool:
        for done in as_completed([pool.submit(work, thing) for thing in things]):
            yield done.result()
