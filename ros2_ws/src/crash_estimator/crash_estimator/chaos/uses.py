"""How the project is used in a run: which processes are started, when it is over, what they have made."""

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from .case import RESTART, Case
from .members import Member, node_command
from .observer import Observer
from .recordings import PLAYING, PLAYING_WITH_RESTART, RECORDINGS

ESTIMATORS = {"kalman": "constrained_kalman", "rls": "rls"}
"""Name -> method."""
DIAGNOSIS, REPLAY = "diagnosis", "replay"
RANKED_EVERY = 0.02
"""s of the crash between two rankings on the way: most of a run's processor goes into the diagnosis."""
WAITING = 120.0
"""s that the replay waits for its listeners."""
STARTING = 60.0
"""s for a process to say its first word."""
SETTLING = 10.0
"""s after the replay's end in which its listeners say that they are done, or will not be."""
ANSWERING = 120.0
"""s for the diagnosis's final answer."""

Start = Callable[[str, list[str]], Member]


class Terminals:
    """Replay, estimators and diagnosis, each from a terminal of its own; the user ends them when they are done."""

    def __init__(self, case: Case, bag: Path, start: Start, observer: Observer, diagnosed: bool = True):
        self.observer = observer
        short, model = RECORDINGS[case.recording], RECORDINGS[case.recording].model
        returns = any(fault.kind == RESTART for fault in case.faults)
        rate = short.seconds / (PLAYING_WITH_RESTART if returns else PLAYING)
        self.members = [
            start(name, node_command("crash_estimator", "estimator", name, model=model, method=method))
            for name, method in ESTIMATORS.items()
        ]
        often = {"every": RANKED_EVERY}
        if diagnosed:
            self.members.append(start(DIAGNOSIS, node_command("crash_estimator", "diagnosis", model=model, **often)))
        asked = {"listeners": [member.name for member in self.members], "wait_timeout": WAITING, "rate": round(rate, 6)}
        self.members.append(start(REPLAY, node_command("crash_replay", "replay", bag=str(bag), **asked)))
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
        if word.done and word.total:
            return True
        has_all = word.total and word.next >= word.total and not word.missing
        return waited > (ANSWERING if name == DIAGNOSIS and has_all else SETTLING)


USES: dict[str, Callable[..., Terminals]] = {"terminals": Terminals, "estimators": partial(Terminals, diagnosed=False)}
"""estimators: the same without the diagnosis, which takes most of the time."""
