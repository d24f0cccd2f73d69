"""crash_msgs/Samples -> arrays."""

import numpy as np
from crash_msgs.msg import Samples

from ..kept import Rows

MOST = 10_000_000
"""Samples in a test that does not say how many it has: to keep more would take all memory."""


def rows_of(message: Samples) -> Rows:
    """The samples of a message, at least one; views into it."""
    time_ns = np.frombuffer(message.time_ns, dtype=np.int64)
    return Rows(message.number, time_ns, np.frombuffer(message.values).reshape(len(time_ns), -1))


def what_is_wrong(message: Samples, channels: int, total: int) -> str:
    """With a message on a test of so many channels and samples (0: not stated); "" for nothing."""
    count, found = len(message.time_ns), len(message.values)
    if not found or found != count * channels:
        return f"expected {count * channels} values ({channels} channels), found {found}"
    return f"the test has {total or MOST} samples" if message.number + count > (total or MOST) else ""
