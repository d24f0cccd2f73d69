"""An MCAP file that opens at every instant: wherever the process is killed while it writes."""

import os
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer
from rosbags.rosbag2.storage_mcap import McapReader

from crash_replay import whole_file
from crash_replay.whole_file import ENDING, MAGIC, PAGE, WholeFile


class Disk:
    """Keeps the calls that change a file, to make it anew as it was after any of them."""

    def __init__(self):
        self.calls: list[tuple[int, bytes]] = []  # (where, what); what None: the file is cut there
        self.real = os.pwrite, os.ftruncate, os.posix_fallocate

    def pwrite(self, handle: int, data: bytes, at: int) -> int:
        self.calls.append((at, bytes(data)))
        return self.real[0](handle, data, at)

    def ftruncate(self, handle: int, size: int) -> None:
        self.calls.append((size, None))
        self.real[1](handle, size)

    def states(self, torn: bool):
        """The file after each call and, with `torn`, within each: the kernel copies page by page."""
        image = bytearray()
        for at, data in self.calls:
            if data is None:
                del image[at:]
                yield bytes(image)
                continue
            cuts = [at + len(data)]
            if torn:
                cuts = [*range(-(-(at + 1) // PAGE) * PAGE, at + len(data), PAGE), at + len(data)]
            for cut in cuts:
                image.extend(bytes(max(0, cut - len(image))))
                image[at:cut] = data[: cut - at]
                yield bytes(image)


@contextmanager
def watched(monkeypatch):
    disk = Disk()
    with monkeypatch.context() as patch:
        patch.setattr(whole_file.os, "pwrite", disk.pwrite)
        patch.setattr(whole_file.os, "ftruncate", disk.ftruncate)
        yield disk


def written(file: Path, chunks: int, seed: int, finish: bool = True) -> list[bytes]:
    """Chunks of random sizes, each flushed; the messages."""
    rng, messages = np.random.default_rng(seed), []
    stream = WholeFile(file)
    writer = Writer(stream)
    writer.start("ros2", "test")
    stream.flush()
    schema = writer.register_schema("a/msg/A", "ros2msg", b"uint8[] data")
    channel = writer.register_channel("/a", "cdr", schema)
    for _ in range(chunks):
        for _ in range(rng.integers(1, 4)):
            messages.append(rng.bytes(rng.integers(1, 30_000)))  # random bytes: not made smaller
            writer.add_message(channel, len(messages), messages[-1], len(messages))
        writer.flush()
    if finish:
        writer.add_metadata("m", {"complete": "true"})
        writer.finish()
        stream.end_file()
    stream.close()
    return messages


def read(file: Path) -> list[bytes]:
    with file.open("rb") as stream:
        return [message.data for _, _, message in make_reader(stream, validate_crcs=True).iter_messages()]


@pytest.mark.parametrize("seed", range(3))
def test_it_opens_after_every_call_and_within_every_call(tmp_path, monkeypatch, seed):
    monkeypatch.setattr(whole_file, "ROOM", 3 * PAGE)  # that it grows often
    monkeypatch.setattr(whole_file, "RESERVE", 0)
    with watched(monkeypatch) as disk:
        messages = written(tmp_path / "whole.mcap", 12, seed)
    counts, killed = [], tmp_path / "killed.mcap"
    for state in disk.states(torn=True):
        killed.write_bytes(state)
        found = read(killed)
        assert found == messages[: len(found)]
        counts.append(len(found))
    assert counts == sorted(counts)
    assert (counts[0], counts[-1]) == (0, len(messages))
    assert len(set(counts)) == 13  # each flush shows its chunk
    assert len(counts) > 100


def test_the_bytes_that_show_a_record_never_lie_across_two_pages(tmp_path, monkeypatch):
    with watched(monkeypatch) as disk:
        written(tmp_path / "whole.mcap", 300, 5)
    short = [(at, len(data)) for at, data in disk.calls if data is not None and len(data) <= len(ENDING)]
    assert len(short) > 300
    assert all(at // PAGE == (at + length - 1) // PAGE for at, length in short)
    assert any(b"\x80" == data[:1] and at % PAGE for at, data in disk.calls[1:] if data)


def test_once_ended_it_is_an_mcap_file_like_any_other(tmp_path):
    messages = written(tmp_path / "whole.mcap", 8, 1)
    assert read(tmp_path / "whole.mcap") == messages
    with (tmp_path / "whole.mcap").open("rb") as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        assert (summary.statistics.message_count, len(summary.chunk_indexes)) == (len(messages), 8)
        assert [record.metadata for record in reader.iter_metadata()] == [{"complete": "true"}]


@pytest.mark.parametrize("finish", [True, False])
def test_rosbags_reads_it_ended_or_not(tmp_path, finish):
    messages = written(tmp_path / "whole.mcap", 8, 2, finish)
    reader = McapReader(tmp_path / "whole.mcap")
    reader.open()
    try:
        assert [bytes(data) for _, _, data in reader.messages(reader.connections)] == messages
    finally:
        reader.close()


FILLS = """
import os, resource, sys
from pathlib import Path
from mcap.writer import Writer
from crash_replay.whole_file import WholeFile
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), resource.RLIM_INFINITY))
stream = WholeFile(Path(sys.argv[1]))
writer = Writer(stream)
writer.start("ros2", "test")
stream.flush()
channel = writer.register_channel("/a", "cdr", writer.register_schema("a/msg/A", "ros2msg", b"uint8[] data"))
try:
    for k in range(1000):
        writer.add_message(channel, k, os.urandom(10_000), k)
        writer.flush()
except OSError as error:
    print(k, error.strerror)
    stream.drop()
    stream.flush()
"""


def test_where_the_disk_is_full_it_stays_as_it_was(tmp_path):
    """A limit on the file's size stands for the disk's."""
    file = tmp_path / "whole.mcap"
    ended = subprocess.run(
        [sys.executable, "-c", FILLS, str(file), str(3 << 20)], capture_output=True, text=True, timeout=60
    )
    assert ended.stdout.endswith("File too large\n"), ended.stderr
    assert len(read(file)) == int(ended.stdout.split()[0]) > 150


def test_nothing_is_overwritten(tmp_path):
    (tmp_path / "there.mcap").write_text("kept")
    stream = WholeFile(tmp_path / "there.mcap")
    stream.write(MAGIC)
    with pytest.raises(FileExistsError):
        stream.flush()
    assert (tmp_path / "there.mcap").read_text() == "kept"
