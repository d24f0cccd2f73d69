"""A test's samples from the topic `/samples` of a recording that `record`, or another recorder, made of a replay.

Samples are numbered: however many passes over the test were recorded, and in whatever order, each number is one sample.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from .bag_contents import Topic
from .message_types import typestore
from .recording import RecordingError

SAMPLES_TOPIC, SAMPLES_TYPE = "/samples", "crash_msgs/msg/Samples"
MOST = 1 << 62
"""Numbers of samples in a test that does not say how many it has."""


def read_samples(where: str, topic: Topic, channels: int, total: int) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,) int64 ns since the impact and values (n, channels) of all numbers that are there, in their order.

    where: what errors begin with; total: samples of the test, 0 where that is not known. Raises RecordingError.
    """
    if topic.type != SAMPLES_TYPE:
        raise RecordingError(f"{where}: must be {SAMPLES_TYPE}, found {topic.type}")
    parts = [_read_message(where, data, channels, total or MOST) for data in topic.messages]
    numbers, times, values = (np.concatenate(column) for column in zip(*parts))
    _, first, of = np.unique(numbers, return_index=True, return_inverse=True)
    again = (times != times[first][of]) | ~_same(values, values[first][of])
    if again.any():
        raise RecordingError(
            f"{where}: sample {numbers[np.argmax(again)]} comes twice with different times or values: there are two "
            "tests in it; record one at a time"
        )
    return times[first], values[first]


def _read_message(where: str, data: bytes, channels: int, total: int) -> Sequence[np.ndarray]:
    try:
        message: Any = typestore().deserialize_cdr(data, SAMPLES_TYPE)
    except Exception as error:  # whatever the bytes make the decoder stumble over
        raise RecordingError(f"{where}: does not decode as {SAMPLES_TYPE} of this version ({error})") from None
    number, times, values = int(message.number), message.time_ns, message.values
    if len(values) != len(times) * channels:
        raise RecordingError(
            f"{where}: samples from number {number}: expected {len(times) * channels} values ({len(times)} instants of "
            f"{channels} channels), found {len(values)}"
        )
    if number + len(times) > total:
        raise RecordingError(f"{where}: samples from number {number}: the test has {total} samples")
    return np.arange(number, number + len(times)), times, values.reshape(len(times), channels)


def _same(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """By row, NaN being NaN."""
    return ((a == b) | (np.isnan(a) & np.isnan(b))).all(axis=1)
