"""A case: a use of the project on a recording, and the faults that befall it. Its name alone makes it again."""

import re
from typing import NamedTuple

from crash_replay.recording import RecordingError

STARTED, PLAYED, FINISHED = "started", "played", "finished"
"""What a moment is counted from: the member's start, s; the share of the samples sent, %; the last sample, s."""

KILL, STOP, RESTART, HANG_UP, FULL_DISK = "kill", "stop", "restart", "hang_up", "full_disk"
"""Of a member: SIGKILL; SIGSTOP, and SIGCONT after so many seconds; SIGKILL, and the same once more after so many
seconds; its terminal is closed; no file that it writes can grow any more."""
ONE_CORE, BUSY, COLD_CACHES = "one_core", "busy", "cold_caches"
"""Of the whole run: one core, with another process beside it; eight of them beside it; nothing compiled yet."""
OF_A_MEMBER = (KILL, STOP, RESTART, HANG_UP, FULL_DISK)
OF_THE_RUN = (ONE_CORE, BUSY, COLD_CACHES)
LASTING = (STOP, RESTART)

_FAULT = re.compile(
    r"(?P<kind>\w+)"
    r"(?::(?P<member>\w+)@(?P<anchor>started|played|finished)(?P<at>[\d.]+)[s%](?::(?P<seconds>[\d.]+)s)?)?"
)
EXAMPLE = "terminals/side/stop:replay@played35%:7.5s+kill:kalman@finished0.2s"


class Fault(NamedTuple):
    kind: str
    member: str = ""
    anchor: str = ""
    at: float = 0.0  # s, or % of the samples
    seconds: float = 0.0  # how long it is stopped, or gone

    @property
    def name(self) -> str:
        if self.kind in OF_THE_RUN:
            return self.kind
        lasts = f":{self.seconds:g}s" if self.kind in LASTING else ""
        return f"{self.kind}:{self.member}@{self.anchor}{self.at:g}{'%' if self.anchor == PLAYED else 's'}{lasts}"


class Case(NamedTuple):
    use: str
    recording: str
    faults: tuple[Fault, ...]

    @property
    def name(self) -> str:
        return f"{self.use}/{self.recording}/{'+'.join(f.name for f in self.faults) or 'undisturbed'}"

    @property
    def undisturbed(self) -> "Case":
        return self._replace(faults=())

    @property
    def seconds(self) -> float:
        """For which its faults last together."""
        return sum(fault.seconds for fault in self.faults)


def case_of(name: str) -> Case:
    """The case that a name means; raises RecordingError where it is not one."""
    parts = name.split("/")
    if len(parts) != 3:
        raise RecordingError(f"a case's name is written like {EXAMPLE}, got {name!r}")
    use, recording, faults = parts
    named = () if faults == "undisturbed" else tuple(_fault_of(text) for text in faults.split("+"))
    return Case(use, recording, named)


def _fault_of(text: str) -> Fault:
    found = _FAULT.fullmatch(text)
    if not found or found["kind"] not in (OF_A_MEMBER if found["member"] else OF_THE_RUN):
        raise RecordingError(f"a fault is written as in {EXAMPLE}, or is one of {', '.join(OF_THE_RUN)}; got {text!r}")
    numbers = float(found["at"] or 0.0), float(found["seconds"] or 0.0)
    return Fault(found["kind"], found["member"] or "", found["anchor"] or "", *numbers)
