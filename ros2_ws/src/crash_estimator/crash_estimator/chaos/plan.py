"""Which cases are run: drawn from a seed, every kind of fault in every use in turn."""

import random
from collections.abc import Sequence

from .case import COLD_CACHES, FINISHED, FULL_DISK, HANG_UP, KILL, ONE_CORE, PLAYED, RESTART, STARTED, STOP, Case, Fault
from .recordings import RECORDINGS
from .uses import STARTER

MEMBERS = {
    "estimators": ("replay", "kalman", "rls", "record"),
    "terminals": ("replay", "kalman", "rls", "record", "diagnosis", "worker"),
    "shown": ("replay", "kalman", "rls", "record", "viewer"),
    "demo": ("demo", "replay", "estimator", "diagnosis", "worker"),
    "demo_shown": ("demo", "replay", "estimator", "diagnosis", "viewer"),
    "launch": ("launch", "replay", "estimator", "diagnosis", "worker", "record"),
}
"""Of each use, those that a fault may befall."""
WRITING = ("record", "viewer")
"""Those that write a file."""
TURNS = (
    "estimators",
    "demo",
    "terminals",
    "estimators",
    "demo",
    "shown",
    "estimators",
    "demo",
    "terminals",
    "demo_shown",
    "launch",
)
"""In turn."""
STOPS = ((0.5, 3.0), (0.5, 3.0), (3.0, 8.0), (8.0, 20.0), (20.0, 60.0))
"""s."""
LONG_STOP = 60.0
GONE = (0.2, 6.0)
"""s between a kill and the start of the same."""

KINDS = (KILL, STOP, RESTART, STOP, KILL, HANG_UP, STOP, FULL_DISK)
"""In turn; a stop is what happens most often to a process."""
EVERY_SECOND_FAULT, EVERY_ONE_CORE, EVERY_LONG_STOP, EVERY_COLD = 4, 8, 43, 101
"""Every so many runs has a second fault, one core only, a stop of a minute, nothing compiled."""


def plan(seed: int, runs: int, uses: Sequence[str] = tuple(MEMBERS)) -> list[Case]:
    """The same cases for the same seed, and any beginning of them a mixture of all."""
    draw, turns = random.Random(seed), [use for use in TURNS if use in uses]
    rounds = [divmod(k, len(turns)) for k in range(runs)]
    return [_case(draw, k, number + turn, turns[turn]) for k, (number, turn) in enumerate(rounds)]


def _case(draw: random.Random, turn: int, kind: int, use: str) -> Case:
    """kind: so counted that each use has each kind of fault in turn."""
    recording = draw.choices(list(RECORDINGS), weights=(3, 1))[0]
    faults = [_fault(draw, use, KINDS[kind % len(KINDS)])]
    if turn % EVERY_SECOND_FAULT == EVERY_SECOND_FAULT - 1:
        faults.append(_fault(draw, use, draw.choice((KILL, STOP, STOP, RESTART))))
    if turn % EVERY_LONG_STOP == EVERY_LONG_STOP - 1:
        faults = [_fault(draw, use, STOP)._replace(seconds=LONG_STOP)]
    if turn % EVERY_ONE_CORE == EVERY_ONE_CORE - 1:
        faults.append(Fault(ONE_CORE))
    if turn % EVERY_COLD == EVERY_COLD - 1:
        faults.append(Fault(COLD_CACHES))
    return Case(use, recording, tuple(faults))


def _fault(draw: random.Random, use: str, kind: str) -> Fault:
    if not any(_can_befall(kind, use, member) for member in MEMBERS[use]):  # nobody there is started again, or hung up
        kind = KILL
    members = [member for member in MEMBERS[use] if _can_befall(kind, use, member)]
    member = draw.choice(members)
    anchor, at = draw.choice(
        (
            (STARTED, round(draw.uniform(0.0, 6.0), 1)),  # before its start is finished
            (PLAYED, round(draw.uniform(0.0, 100.0))),
            (PLAYED, round(draw.uniform(0.0, 100.0))),
            (PLAYED, round(draw.uniform(75.0, 100.0))),  # the last second
            (FINISHED, round(draw.uniform(0.0, 1.0), 1)),
        )
    )
    seconds = {STOP: draw.uniform(*draw.choice(STOPS)), RESTART: draw.uniform(*GONE)}.get(kind, 0.0)
    return Fault(kind, member, anchor, float(at), round(seconds, 1))


def _can_befall(kind: str, use: str, member: str) -> bool:
    if kind == FULL_DISK:
        return member in (*WRITING, "demo")
    if member == "launch":  # ended by force it leaves its processes behind
        return kind == STOP
    if member == "worker" or (use in STARTER and member != "demo"):  # somebody else has started it
        return kind in (KILL, STOP)
    if kind == RESTART:
        return member not in WRITING and use not in STARTER  # a second recorder overwrites nothing
    return True
