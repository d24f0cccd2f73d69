"""One run of a case: started, disturbed, ended, and what it has left."""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from ..demo.domain import free_domain
from .case import BUSY, COLD_CACHES, HANG_UP, ONE_CORE, Case
from .faults import Faults
from .judge import Content, Ended, Outcome, Verdict, judged
from .members import Member, children_of, command_line, send
from .observer import PATIENCE, Observer
from .recordings import bag_of
from .uses import DIAGNOSIS, STARTER, USES, Broken, estimators_of

LIMIT = 480.0
"""s that a run may take, beside the time for which its faults last: more than the programs say that they wait."""
COMPILING = 1020.0
"""s more where nothing is compiled yet."""
TRIES = 3
"""Of a case, where others on this machine have come into its ROS domain."""
BURNING = 8
"""Processes beside a busy run."""
BURNER = [sys.executable, "-c", "from crash_replay.starting import begin; begin()\nwhile True: pass"]
ENDING = 60.0
"""s for a process that is told to end."""
ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
STARTED_BY_ONE = ("demo", "replay", "diagnosis", "viewer", "record")
"""Names of nodes, beside the estimators'."""
MARKS = {
    "worker": "diagnosis_answerer",  # the diagnosis's process that computes
    "replay": "/crash_replay/replay ",
    "estimator": "/crash_estimator/estimator ",
    "diagnosis": "/crash_estimator/diagnosis ",
    "viewer": "/crash_estimator/viewer ",
    "record": "/crash_replay/record ",
}
"""In the command lines of processes that we have not started ourselves."""


class Run:
    def __init__(self, case: Case, folder: Path, bags: Path):
        """folder: for its logs, emptied before."""
        for number in (signal.SIGINT, signal.SIGHUP):
            if signal.getsignal(number) == signal.SIG_IGN:  # started in the background: what we start would inherit it
                signal.signal(number, signal.default_int_handler)
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        self.case, self.folder, self.bag = case, folder, bag_of(case.recording, bags)
        self.conditions = {fault.kind for fault in case.faults if not fault.member}
        self.terminals = {fault.member for fault in case.faults if fault.kind == HANG_UP}
        self.tops: dict[str, Member] = {}
        self.finished_at = 0.0
        domain = free_domain()
        self.environment = os.environ | ONE_THREAD
        self.environment |= {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        self.environment["PYTHONUNBUFFERED"] = "1"  # who is killed has said what he has said
        if COLD_CACHES in self.conditions:
            self.environment["NUMBA_CACHE_DIR"] = str(folder / "cache")
        self.estimators = estimators_of(case)
        self.observer = Observer(domain, self.estimators)
        self.faults = Faults(list(case.faults), self)

    def outcome(self) -> Outcome:
        """Do it. All of its processes have ended then."""
        cores = os.sched_getaffinity(0)
        try:
            if ONE_CORE in self.conditions:
                os.sched_setaffinity(0, {min(cores)})  # what is started inherits it
            for k in range((ONE_CORE in self.conditions) + BURNING * (BUSY in self.conditions)):
                self._start(f"burner {k}", BURNER)
            self.use = USES[self.case.use](self.case, self.bag, self.folder, self._start, self.observer)
            endless = self._follow()
            ended = self._end()
            try:
                products, broken = self.use.products(), ""
            except Broken as error:
                products, broken = {}, str(error)
            return Outcome(ended, products, self.observer.sent_any, endless, broken)
        finally:
            os.sched_setaffinity(0, cores)
            self._end_all()
            self.observer.close()

    def _follow(self) -> str:
        limit = time.monotonic() + LIMIT + self.case.seconds + COMPILING * (COLD_CACHES in self.conditions)
        while self.faults.active or not self.use.is_over():
            self.observer.spin(0.02)
            self.observer.ask_for_missed()
            if self.observer.finished and not self.finished_at:
                self.finished_at = time.monotonic()
            self.faults.look()
            if time.monotonic() > limit:
                running = [member.name for member in self.use.members if member.status is None]
                return f"after {LIMIT + self.case.seconds:g} s still running: {', '.join(running)}"
        running = [name for name in self.estimators if name in self.tops and self.tops[name].status is None]
        deadline = time.monotonic() + PATIENCE
        while not all(map(self.observer.has_heard_all, running)) and time.monotonic() < deadline:
            self.observer.spin(0.02)
            self.observer.ask_for_missed()
        return ""

    def _end(self) -> list[Ended]:
        """Tell those that still run to end, as with Ctrl-C."""
        members = self.use.members
        for member in members:
            if member.status is None:
                send(member.process.pid, signal.SIGINT)
        deadline = time.monotonic() + ENDING
        self.observer.spin(ENDING, lambda: all(m.status is not None for m in members) or time.monotonic() > deadline)
        return [Ended(m.name, m.status, m.said(), m.disturbed, self._had_all(m.name)) for m in members]

    def _end_all(self) -> None:
        for member in self.tops.values():
            for process in [*children_of(member.process.pid), member.process.pid]:
                if member.status is None or process != member.process.pid:
                    send(process, signal.SIGKILL)
            member.process.wait()

    def _had_all(self, name: str) -> bool:
        """Whether nobody but itself can know how it ended; who starts the others has nobody beside it."""
        word = self.observer.words.word(f"/{name}")
        return name in STARTER.values() or (
            word is not None and word.total > 0 and word.next >= word.total and not word.missing
        )

    @property
    def strangers(self) -> list[str]:
        """Nodes that take part and are not of the run: somebody else came upon the same ROS domain."""
        own = {*self.tops, *self.estimators, *(STARTED_BY_ONE if self.case.use in STARTER else ())}
        return sorted(set(self.observer.words.names()) - {f"/{name}" for name in own})

    def _start(self, name: str, command: list[str]) -> Member:
        log = self.folder / f"{name}.log"
        self.tops[name] = Member(name, command, self.environment, log, terminal=name in self.terminals)
        return self.tops[name]

    # what faults look at

    def top(self, name: str) -> Member | None:
        return self.tops.get(name)

    def process(self, name: str) -> int:
        member = self.tops.get(name)
        if member:
            return member.process.pid if member.status is None else 0
        starter = self._starter()
        mark = MARKS[name]
        return next((child for child in children_of(starter.process.pid) if mark in command_line(child)), 0)

    def since_start(self, name: str) -> float:
        return time.monotonic() - (self.tops.get(name) or self._starter()).started_at

    def _starter(self) -> Member:
        """Of those that we have not started ourselves."""
        return self.tops[STARTER.get(self.case.use, DIAGNOSIS)]

    @property
    def played(self) -> float:
        return self.observer.played

    @property
    def since_finish(self) -> float:
        return time.monotonic() - self.finished_at if self.finished_at else -1.0


def commit() -> str:
    """Of the code that runs, in short."""
    asked = ["git", "-C", str(Path(__file__).resolve().parent), "rev-parse", "--short", "HEAD"]
    try:
        return subprocess.run(asked, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def run_case(case: Case, out: Path, reference: dict[str, Content] | None) -> dict:
    """Its row of results; without a reference it is to become one itself."""
    began, code = time.monotonic(), commit()
    folder = out / "logs" / case.name.replace("/", "__").replace(":", ".")
    for _ in range(TRIES):
        run = Run(case, folder, out / "recordings")
        outcome = run.outcome()
        if not run.strangers:
            break
    contents = {name: dict(product.content) for name, product in outcome.products.items()}
    if reference is None and any(not content for content in contents.values()):
        empty = ", ".join(name for name, content in contents.items() if not content)
        verdict = Verdict("FAILED", f"undisturbed, and there is nothing of: {empty}")
    else:
        verdict = judged(outcome, reference or contents)
    return {
        "case": case.name,
        "code": code,
        "verdict": verdict.verdict,
        "why": verdict.why,
        "seconds": round(time.monotonic() - began, 1),
        "carried out": run.faults.log,
        "not carried out": [fault.name for fault in run.faults.pending],
        "statuses": {ended.name: ended.status for ended in outcome.ended},
        "contradictions": {name: len(numbers) for name, numbers in run.observer.contradictions.items() if numbers},
        "strangers": run.strangers,
        "contents": contents if reference is None else {},
    }
