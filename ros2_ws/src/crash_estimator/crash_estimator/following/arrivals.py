"""What comes of a replay, told apart: the next samples, another pass over the test, samples lost or sent twice."""

from dataclasses import dataclass
from typing import NamedTuple

from ..kept import Rows


class Arrival(NamedTuple):
    rows: Rows  # those that are new; may be none
    begins: bool  # another pass over the test
    lost: int  # samples of this pass that should have come before them
    repeated: int  # samples that had come already, left out


@dataclass
class Waiting:
    """Samples that have come and are to be estimated."""

    arrival: Arrival
    run: int
    stamp_ns: int  # of the first of them
    first: int  # number of the pass's first sample
    sent_again: int = 0  # samples that were missing before them and have been got since
    without: bool = False  # what is missing cannot be had
    begun: bool = False  # the pass that begins with them has been begun


class Arrivals:
    """Counts on from what has come."""

    def __init__(self):
        self.run, self.first, self.next = 0, 0, 0  # the pass, its first sample, the next one
        self.begun = False
        self.missed = 0  # lost ones, in all

    def receive(self, run: int, rows: Rows) -> Arrival:
        """A pass begins with another run, or with sample 0: a replay that was started anew begins at run 0 again."""
        begins = not self.begun or run != self.run or rows.number == 0
        if begins:
            self.run, self.first, self.next, self.begun = run, rows.number, rows.number, True
        lost, repeated = max(0, rows.number - self.next), min(max(0, self.next - rows.number), len(rows.time_ns))
        self.missed += lost
        self.next = max(self.next, rows.end)
        return Arrival(rows.without(repeated) if repeated else rows, begins, lost, repeated)


def missing_text(number: int, missing: int, sent_again: int, holds_from: int, joined_late: bool) -> str:
    """A line on samples that had not been seen before sample `number`; holds_from: as in Follower."""
    text = f"{missing} samples before number {number} were not seen"
    if sent_again:
        text += f": the replay has sent {'them' if not holds_from else sent_again} again"
    elif joined_late:
        text += ": the pass was joined late, its motion up to here is unknown"
    return text + (f"; the estimates rest on every sample from number {holds_from} on" if holds_from else "")
