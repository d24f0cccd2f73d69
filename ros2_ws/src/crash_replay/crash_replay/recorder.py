"""Messages into an MCAP file as they come, on disk within a fraction of a second, and readable whatever happens then.

The order is that of arrival: log time is when a message was written, publish time its stamp, so that a second pass over
the test follows the first. What is kept in memory is some 1 kB of index for each chunk.
"""

import time
from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from hashlib import blake2b
from pathlib import Path
from typing import IO, NamedTuple, cast

from mcap.data_stream import RecordBuilder
from mcap.records import Metadata

from .bag_writer import LATCHED, STREAM, BagWriter, TopicToWrite
from .message_types import typestore
from .qos import EVENTS
from .recorded_topics import RANKING, REVISION, SAID_BY_NODE, STAMPED, sayer_of, stamp_of
from .whole_file import WholeFile

SHOWN_AFTER = 0.15
"""s after which a message is in the file, at the next message or look."""
ON_DISK_AFTER = 5.0
"""s after which the system is told to bring the file onto the disk."""
REMEMBERED = 2 * EVENTS.depth
"""Messages of a topic that its publisher keeps for late joiners, and more than any publisher of this project does."""
KEPT_IN_NUMBER = {RANKING, "crash_msgs/msg/Misfit", REVISION, "crash_msgs/msg/Event"}
"""Types of latched topics of which more than the last message is kept."""
METADATA = "crash_replay"
"""The record that says whether the recording is complete, and what is missing."""


class Heard(NamedTuple):
    """A topic that is recorded."""

    name: str
    type: str
    latched: bool
    own: bool = True  # of the recorder's namespace


class Repeats:
    """Notices what a publisher sends again to one who joins late: a recorder that stood still joins a second time."""

    def __init__(self, topic: Heard):
        self.topic = topic
        self.last: dict[str, bytes] = {}  # digest of the last message, by node
        self.recent, self.order = set[bytes](), deque[bytes]()

    def repeated(self, data: bytes) -> bool:
        digest = blake2b(data, digest_size=16).digest()
        if self.topic.type in KEPT_IN_NUMBER:
            if digest in self.recent:
                return True
            self.recent.add(digest)
            self.order.append(digest)
            if len(self.order) > REMEMBERED:
                self.recent.discard(self.order.popleft())
            return False
        sayer = sayer_of(data) if self.topic.type in SAID_BY_NODE else ""
        before, self.last[sayer] = self.last.get(sayer), digest
        return before == digest


class Recorder:
    """Not for several threads. Every method raises OSError where the disk does not take it."""

    def __init__(self, file: Path):
        """Raises FileExistsError: nothing is overwritten."""
        typestore()  # takes its time, when nothing has to be heard yet
        self.file, self.stream = file, WholeFile(file)
        self.writer = BagWriter(cast(IO[bytes], self.stream), data_crc=False)
        self.stream.flush()
        self.topics: dict[str, int] = {}  # indices in the file, by name
        self.repeats: dict[str, Repeats] = {}  # of latched topics
        self.log_time = 0  # ns
        self.held_since: float | None = None  # monotonic s, of the oldest message that is not in the file yet
        self.syncing, self.disk = Future[None](), ThreadPoolExecutor(1, "sync")
        self.syncing.set_result(None)
        self.synced = time.monotonic()

    @property
    def count(self) -> int:
        return sum(self.writer.counts)

    def hear(self, topic: Heard, data: bytes) -> bool:
        """False: it was said before, and is not written again."""
        if topic.latched and self.repeats.setdefault(topic.name, Repeats(topic)).repeated(data):
            return False
        if topic.name not in self.topics:
            written = TopicToWrite(topic.name, topic.type, LATCHED if topic.latched else STREAM)
            self.topics[topic.name] = self.writer.add_topic(written)
        self.log_time = max(self.log_time, time.time_ns())  # the clock may be set back
        stamp = max(0, stamp_of(data)) if topic.type in STAMPED else self.log_time
        self.writer.write(self.topics[topic.name], self.log_time, data, stamp)
        if self.held_since is None:
            self.held_since = time.monotonic()
        self.look()
        return True

    def look(self) -> None:
        """To be called often: into the file with what has waited long enough."""
        now = time.monotonic()
        if self.held_since is None or now - self.held_since < SHOWN_AFTER:
            return
        self.writer.writer.flush()
        self.held_since = None
        if now - self.synced > ON_DISK_AFTER and self.syncing.done():
            self.syncing.result()
            self.synced, self.syncing = now, self.disk.submit(self.stream.sync)

    def close(self, missing: str) -> None:
        """End the file; missing: what it lacks of the test, "" where it is complete."""
        self.writer.writer.flush()
        self.disk.shutdown()
        self.writer.writer.add_metadata(METADATA, _metadata(missing))
        self.writer.finish(self.file.name)
        self.stream.end_file()
        self.stream.close()

    def give_up(self, missing: str) -> None:
        """Leave the file as it is, with a last word where there is room for it: the disk has taken no more."""
        self.disk.shutdown()
        self.stream.drop()
        record = RecordBuilder()
        Metadata(METADATA, _metadata(missing)).write(record)
        self.stream.write(record.end())
        try:
            self.stream.flush()
        finally:
            self.stream.close()


def _metadata(missing: str) -> dict[str, str]:
    return {"complete": "false" if missing else "true", "missing": missing}
