"""How the project is used in a run: which processes are started, when it is over, what they have made."""

import re
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from .case import RESTART, Case
from .contents import recorded, says_incomplete
from .judge import FAULTY, Product
from .members import Member, node_command
from .observer import Observer
from .recordings import PLAYING, PLAYING_WITH_RESTART, RECORDINGS

ESTIMATORS = {"kalman": "constrained_kalman", "rls": "rls"}
"""Name -> method."""
REPLAY, DIAGNOSIS, VIEWER, RECORD, DEMO, LAUNCH = "replay", "diagnosis", "viewer", "record", "demo", "launch"
TOLD = re.compile(
    r"all samples|what it lacks|not told from|share of|where it fails|the error falls|verdict with it|added to"
)
"""How the lines of the demonstration's story begin that are the same each time."""
RECORDING, RRD = "recording.mcap", "crash.rrd"
RANKED_EVERY = 0.02
"""s of the crash between two rankings on the way: most of a run's processor goes into the diagnosis."""
WAITING = 90.0
"""s that the replay waits for its listeners, beside those for which faults last."""
STARTING = 60.0
"""s for a process to say its first word."""
SETTLING = 10.0
"""s after the replay's end in which its listeners say that they are done, or will not be."""
ANSWERING = 120.0
"""s for the diagnosis's final answer."""

Start = Callable[[str, list[str]], Member]


class Broken(RuntimeError):
    """A file that was left cannot be read; the message is one line."""


class Terminals:
    """Replay, estimators, record and more, each from a terminal of its own; the user ends them when they are done."""

    def __init__(self, case: Case, bag: Path, folder: Path, start: Start, observer: Observer, also: Sequence[str] = ()):
        """also: the diagnosis, the viewer."""
        self.observer = observer
        short, model = RECORDINGS[case.recording], RECORDINGS[case.recording].model
        returns = any(fault.kind == RESTART for fault in case.faults)
        rate = short.seconds / (PLAYING_WITH_RESTART if returns else PLAYING)
        commands = {
            name: node_command("crash_estimator", "estimator", name, model=model, method=method)
            for name, method in ESTIMATORS.items()
        }
        if DIAGNOSIS in also:
            commands[DIAGNOSIS] = node_command("crash_estimator", "diagnosis", model=model, every=RANKED_EVERY)
        if VIEWER in also:
            shown: dict[str, Any] = {"rrd": str(folder / RRD), "port": 0, "open": False}
            commands[VIEWER] = node_command("crash_estimator", "viewer", estimators=[*ESTIMATORS], **shown)
        self.recording = folder / RECORDING
        commands[RECORD] = node_command("crash_replay", "record", to=str(self.recording), wait_for=len(ESTIMATORS))
        asked: dict[str, Any] = {
            "listeners": [*commands],
            "wait_timeout": WAITING + case.seconds,
            "rate": round(rate, 6),
        }
        commands[REPLAY] = node_command("crash_replay", "replay", bag=str(bag), **asked)
        self.members = [start(name, command) for name, command in commands.items()]
        self.replay_ended = 0.0

    def is_over(self) -> bool:
        """Whether the replay has ended and the others are done, or have had time to be."""
        *others, replay = self.members
        if replay.status is None:
            self.replay_ended = 0.0
            return False
        self.replay_ended = self.replay_ended or time.monotonic()
        waited = time.monotonic() - self.replay_ended
        return all(member.status is not None or self._is_done(member.name, waited) for member in others)

    def _is_done(self, name: str, waited: float) -> bool:
        word = self.observer.words.word(f"/{name}")
        if word is None:  # it is still being started: nobody ends what he has just begun
            return waited > STARTING
        if word.done and word.total and name != RECORD:  # which ends by itself
            return True
        has_all = word.total and word.next >= word.total and not word.missing
        answering = any(m.name == DIAGNOSIS and m.status is None for m in self.members)
        return waited > (ANSWERING if has_all and answering and name in (DIAGNOSIS, RECORD) else SETTLING)

    def products(self) -> dict[str, Product]:
        """Raises Broken."""
        made = {f"estimates of {name}": Product(name, said) for name, said in heard(self.observer).items()}
        if any(member.name == DIAGNOSIS for member in self.members):
            made["diagnosis"] = Product(DIAGNOSIS, answers(self.observer))
        return made | {"recording": in_file(RECORD, self.recording)}


def heard(observer: Observer) -> dict[str, dict[str, str]]:
    """The estimates of each estimator."""
    return {name: {str(k): v for k, v in estimates.items()} for name, estimates in observer.estimates.items()}


def answers(observer: Observer) -> dict[str, str]:
    return {str(k): v for k, v in observer.final.items()}


def in_file(owner: str, recording: Path) -> Product:
    """Raises Broken."""
    if not recording.exists():
        return Product(owner, {})
    try:
        return Product(owner, recorded(recording), says_incomplete(recording))
    except Exception as error:
        raise Broken(f"{RECORDING} does not open with mcap's reader: {error!r}") from error


class Demo:
    """`demo`, which starts the others itself."""

    def __init__(
        self, case: Case, bag: Path, folder: Path, start: Start, observer: Observer, options: Sequence[str] = ()
    ):
        self.observer, self.out = observer, folder / "out"
        short = RECORDINGS[case.recording]
        told = ["--recording", str(bag), "--model", short.model, "--rate", f"{short.seconds / PLAYING:.6f}"]
        self.members = [start(DEMO, [*node_command("crash_estimator", DEMO), *told, "--out", str(self.out), *options])]

    def is_over(self) -> bool:
        return self.members[0].status is not None

    def products(self) -> dict[str, Product]:
        """Raises Broken."""
        for log in self.out.rglob("*.log"):
            if found := FAULTY.search(log.read_text(encoding="utf-8", errors="replace")):
                raise Broken(f"{log.name}: {found[0]}")
        made = {f"estimates of {name}": Product(DEMO, said) for name, said in heard(self.observer).items()}
        return made | {"diagnosis": Product(DEMO, answers(self.observer)), "story": Product(DEMO, self._story())}

    def _story(self) -> dict[str, str]:
        """What it tells of the crash: the lines that are the same each time."""
        lines = self.members[0].said().splitlines()
        return {line: "" for line in lines if TOLD.match(line)}


class Launch:
    """The launch file, see `launching`, with the diagnosis and `record`; it ends when all is recorded."""

    def __init__(self, case: Case, bag: Path, folder: Path, start: Start, observer: Observer):
        self.observer, self.recording = observer, folder / RECORDING
        short = RECORDINGS[case.recording]
        given = {"bag": bag, "model": short.model, "rate": f"{short.seconds / PLAYING:.6f}", "record": self.recording}
        given |= {"diagnosis": "true", "viewer": "false", "exit_when_finished": "true"}
        told = [f"{name}:={value}" for name, value in given.items()]
        self.members = [start(LAUNCH, [sys.executable, "-m", "crash_estimator.chaos.launching", *told])]

    def is_over(self) -> bool:
        return self.members[0].status is not None

    def products(self) -> dict[str, Product]:
        """Raises Broken."""
        recording = in_file(LAUNCH, self.recording)
        made = {}
        for name, said in heard(
            self.observer
        ).items():  # who is gone gives the judge nothing once more; what he said is
            topic = f"/{name}/block/parameters "  # in the recording
            written = {
                key.removeprefix(topic): said for key, said in recording.content.items() if key.startswith(topic)
            }
            made[f"estimates of {name}"] = Product(LAUNCH, written | said)
        made["diagnosis"] = Product(LAUNCH, answers(self.observer))
        return made | {"recording": recording}


USES: dict[str, Callable[..., Terminals | Demo | Launch]] = {
    "estimators": Terminals,
    "terminals": partial(Terminals, also=(DIAGNOSIS,)),
    "shown": partial(Terminals, also=(VIEWER,)),
    "demo": partial(Demo, options=("--no-viewer",)),
    "demo_shown": Demo,
    "launch": Launch,
}
"""estimators, shown: without the diagnosis, which takes most of the time; demo: without the viewer."""
STARTER = {"demo": DEMO, "demo_shown": DEMO, "launch": LAUNCH}
"""Those in which one process starts the others, and which."""


def estimators_of(case: Case) -> list[str]:
    """The names of their nodes; the demonstration calls its own as their model."""
    if case.use in STARTER:
        return ["estimator" if case.use == LAUNCH else RECORDINGS[case.recording].model]
    return list(ESTIMATORS)
