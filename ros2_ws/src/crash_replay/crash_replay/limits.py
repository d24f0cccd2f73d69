"""How large, long, deep and many what comes from outside may be: one table for files, messages, parameters and models.

Each limit is far beyond any crash test and far below what harms the machine. A check says in words what is wrong, ""
for nothing; who asks puts the file, topic or key before it and raises an error of its own.
"""

import math
import stat
from collections.abc import Iterable
from numbers import Real
from pathlib import Path
from reprlib import Repr
from typing import Any, NamedTuple

import numpy as np


class Range(NamedTuple):
    """What a number may be, both ends included, and why no more."""

    lowest: float
    highest: float
    unit: str
    why: str

    def wrong(self, value: Any) -> str:
        """ "must be ..., got ..." for what is no number, not finite or out of range; a truth value is no number."""
        number: Any = value if isinstance(value, Real) and not isinstance(value, bool) else math.nan
        if self.lowest <= number <= self.highest:
            return ""
        ends = f"a number from {self.lowest:g} to {self.highest:g} {self.unit}".rstrip()
        return f"must be {ends}, got {shown(value)}"


# of a test
SAMPLES = Range(0, 10_000_000, "samples", "17 minutes at 10 kHz: one node keeps them all in memory")
CHANNELS = Range(0, 2000, "channels", "an NHTSA test numbers its curves with three digits")
BYTES = Range(0, 2**30, "bytes", "of the numbers of one test: several processes keep them at a time")
TIME = Range(-1e4, 1e4, "s", "since the impact: a crash lasts less than a second, a stamp counts to 2^31 s")
PERIOD = Range(1e-9, 10.0, "s", "between two samples: a stamp counts whole ns; seldomer than that is no crash")
STAMP = Range(0, 2**31 - 2 * TIME.highest, "s", "of the impact: with the time since it, it still is a ROS stamp")
UNDATED = Range(0, 365 * 86_400, "s", "stamp of an impact of which nobody knows the date")
VELOCITY = Range(-1e4, 1e4, "m/s", "thirty times the speed of sound")
DISPLACEMENT = Range(-1e4, 1e4, "m", "at time zero, between parts of one test")
VALUE = Range(-1e12, 1e12, "", "in SI units: its square times a thousand samples is still exact enough to compute with")
TEXT = Range(0, 10_000, "characters", "of a name, title or note: it is shown in one line")

# of a model
NUMBER = Range(-1e30, 1e30, "", "a coefficient of the ninth power of the crush is the largest there is")
MASS = Range(1e-6, 1e9, "kg", "from a milligram to ten large ships")

# of a file
YAML_FILE = Range(0, 200_000, "bytes", "a model of a hundred bodies has 10 000")
YAML_DEPTH = Range(0, 20, "levels", "the deepest key of ours is at the fifth")
YAML_PARTS = Range(0, 15_000, "parts", "keys and values, an anchor's counted wherever it is used")
TABLE_FILE = Range(0, 500_000_000, "bytes", "text of a test whose numbers just fit into BYTES")
CURVE_FILE = Range(0, 100_000_000, "bytes", "text of one channel")
HEADER_FILE = Range(0, 10_000_000, "bytes", "a header of 1000 curves has 200 000")
UNPACKED = Range(0, 4 * 2**30, "bytes", "of a bag: its numbers take a tenth of that")
UNPACKED_SMALL, UNPACKED_RATIO = 16_000_000, 100
"""Bytes to which any bag may unpack, and how many times its size a larger one: what sensors say packs 3 to 20 times."""

# of NHTSA's database
TEST_NUMBER = Range(1, 99_999, "", "the database counts to about 16 000, its files have five digits")
ANSWER = Range(0, 50_000_000, "bytes", "the metadata of a test of 1000 curves has 1 000 000")
PACKAGE = Range(0, 500_000_000, "bytes", "a test of 1000 curves packs to 40 000 000")
PACKED_FILES = Range(0, 5000, "files", "a curve each, and a header")

# of a message
MESSAGE = Range(0, 64_000_000, "bytes", "a block of 10 000 samples of 800 channels")


def shown(value: Any) -> str:
    """A value in a line of a message: in a few words, however large or deep it is."""
    if value is None:
        return "nothing"
    text = _SHORT.repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


class _Short(Repr):
    """repr that never writes out the millions of parts that a value may have."""

    def __init__(self):
        super().__init__()
        self.maxlevel, self.maxlist, self.maxtuple, self.maxdict, self.maxset, self.maxstring = 2, 4, 4, 4, 4, 60

    def repr_int(self, value: int, _level: int) -> str:
        return repr(value) if value.bit_length() < 200 else f"a number of {value.bit_length()} bits"


_SHORT = _Short()


def count_wrong(what: str, count: int, limit: Range) -> str:
    """For counts, lengths and sizes: "has 3000 channels, at most 2000 are read"."""
    return "" if count <= limit.highest else f"{what} {count} {limit.unit}, more than the {limit.highest:.0f} allowed"


def size_wrong(samples: int, channels: int) -> str:
    """Of a test whose numbers would be kept in memory."""
    wrong = count_wrong("has", samples, SAMPLES) or count_wrong("has", channels, CHANNELS)
    return wrong or count_wrong(
        f"with {samples} samples of {channels} channels takes", bytes_of(samples, channels), BYTES
    )


def bytes_of(samples: int, channels: int) -> int:
    """That the times and values of so many samples take."""
    return 8 * samples * (channels + 1)


def most_samples(channels: int) -> int:
    """Of a test that does not say how many it has."""
    return int(min(SAMPLES.highest, BYTES.highest // bytes_of(1, channels)))


def text_wrong(texts: Iterable[str]) -> str:
    longest = max(map(len, texts), default=0)
    return count_wrong("has a text of", longest, TEXT)


def times_wrong(seconds: np.ndarray) -> str:
    """Of times since the impact (n,) that are to be whole ns: finite and within TIME."""
    bad = np.flatnonzero(~(np.abs(seconds) <= TIME.highest))
    return f"sample {bad[0]}: time {TIME.wrong(float(seconds[bad[0]]))}" if len(bad) else ""


def valid_values(values: np.ndarray, factor: float = 1.0) -> np.ndarray:
    """The values times a factor, NaN where one is not finite or beyond what any sensor can mean (VALUE)."""
    with np.errstate(over="ignore", invalid="ignore"):
        values = factor * values
    return np.where(np.abs(values) <= VALUE.highest, values, math.nan)


def file_wrong(path: Path, limit: Range) -> str:
    """Of a file that is to be read: it must be one (no folder, device or pipe), and no larger. Raises OSError."""
    found = path.stat()
    if not stat.S_ISREG(found.st_mode):
        return "is not a file" if not stat.S_ISDIR(found.st_mode) else "is a folder, not a file"
    return count_wrong("has", found.st_size, limit)
