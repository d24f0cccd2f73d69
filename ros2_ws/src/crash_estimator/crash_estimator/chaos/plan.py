"""Which cases are run: drawn from a seed, every kind of fault in every use in turn."""

import random
from collections.abc import Sequence

from .case import COLD_CACHES, FINISHED, HANG_UP, KILL, ONE_CORE, PLAYED, RESTART, STARTED, STOP, Case, Fault
from .recordings import RECORDINGS

MEMBERS = {
    "terminals": ("replay", "kalman", "rls", "diagnosis", "worker"),
    "estimators": ("replay", "kalman", "rls"),
}
"""Of each use, those that a fault may befall."""
STOPS = ((0.5, 3.0), (3.0, 6.0), (6.0, 20.0))
"""s: within the middleware's lease of 5 s, about it, and beyond."""
LONG_STOP = 60.0
GONE = (0.2, 6.0)
"""s between a kill and the start of the same."""

KINDS = (KILL, STOP, RESTART, STOP, KILL, HANG_UP, STOP, RESTART)
"""In turn; a stop is what happens most often to a process."""
EVERY_SECOND_FAULT, EVERY_ONE_CORE, EVERY_LONG_STOP, EVERY_COLD = 4, 8, 23, 67
"""Every so many runs has a second fault, one core only, a stop of a minute, nothing compiled."""


def plan(seed: int, runs: int, uses: Sequence[str] = tuple(MEMBERS)) -> list[Case]:
    """The same cases for the same seed, and any beginning of them a mixture of all."""
    draw = random.Random(seed)
    return [_case(draw, k // len(uses), uses[k % len(uses)]) for k in range(runs)]


def _case(draw: random.Random, turn: int, use: str) -> Case:
    recording = draw.choices(list(RECORDINGS), weights=(1, 3))[0]
    faults = [_fault(draw, use, KINDS[turn % len(KINDS)])]
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
    members = [m for m in MEMBERS[use] if m != "worker" or kind in (KILL, STOP)]
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
