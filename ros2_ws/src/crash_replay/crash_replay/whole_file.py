"""An MCAP file that is whole at every instant while it is written: kill -9, and it opens with all that was shown.

Behind the last record lies a gap, one record of a private type that readers skip, and behind the gap the ending that
a reader looks for at the end of a file. New records go into the gap, where nobody sees them; the 9 bytes that begin
the first of them, written last and in place of those that begin the gap, show all of them at once. These 9 bytes never
lie across the boundary of two pages: the kernel copies them whole or not at all, whatever kills the process. The
same holds for the ending when the file grows. So there is also always room for the ending when the disk is full.

    magic, header, chunks, ... | gap | ending            while it is written
    magic, header, chunks, ... | summary, footer, magic  once it is closed: an MCAP file like any other

A power cut is another matter: then what was not yet on the disk (`sync`) may be missing in any order.
"""

import os
import struct
from pathlib import Path

MAGIC = b"\x89MCAP0\r\n"
RECORD = struct.Struct("<BQ")
"""What a record begins with: its type and its length without these 9 bytes (MCAP's specification)."""
DATA_END, FOOTER, PRIVATE = 0x0F, 0x02, 0x80
ENDING = RECORD.pack(DATA_END, 4) + bytes(4) + RECORD.pack(FOOTER, 20) + bytes(20) + MAGIC
"""No checksum and no summary: readers then go through the records from the start."""

PAGE = 4096
"""Bytes; on machines with larger pages they are multiples of it."""
ROOM = 1 << 20
"""Bytes of gap that the file grows by, on the disk at once: what a full disk stops is the growing."""
RESERVE = 1 << 16
"""Bytes of the gap for a last word when the disk is full."""


class WholeFile:
    """A stream for mcap's Writer: `write` holds records back, `flush` shows them."""

    def __init__(self, file: Path):
        """The file is made at the first flush: it is never seen empty, but for an instant."""
        self.file, self.handle = file, -1
        self.end = self.size = 0  # where the gap begins; of the file
        self.held = bytearray()
        self.reserve = RESERVE

    def write(self, data: bytes) -> int:
        self.held += data
        return len(data)

    def tell(self) -> int:
        return self.end + len(self.held)

    def flush(self) -> None:
        """Show what was written: whole records, at first no more than the header.

        Raises OSError; then the file is as it was before. At first FileExistsError: nothing is overwritten.
        """
        if not self.held:
            return
        if not self.size:
            self._begin()
        else:
            self._show(bytes(self.held) + self._filler(self.tell()))
        self.held.clear()

    def sync(self) -> None:
        """To the disk, which takes its time; may be called from another thread."""
        os.fdatasync(self.handle)

    def drop(self) -> None:
        """What is held, for which the disk has no room; what is written now may use what was kept free for it."""
        self.held.clear()
        self.reserve = 0

    def end_file(self) -> None:
        """Show what is held, the end of an MCAP file with its footer and magic, and take the gap away."""
        self.reserve = 0
        self._show(bytes(self.held))
        self.held.clear()
        os.ftruncate(self.handle, self.end)

    def close(self) -> None:
        try:
            self.sync()
        finally:
            os.close(self.handle)

    def _begin(self) -> None:
        """One page in one piece."""
        self.size, self.end = PAGE, len(self.held)
        page = (bytes(self.held) + self._gap()).ljust(PAGE - len(ENDING), b"\0") + ENDING
        self.handle = os.open(self.file, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666)
        self._put(0, page)

    def _show(self, records: bytes) -> None:
        end = self.end + len(records)
        if end + RECORD.size + self.reserve + len(ENDING) > self.size:
            self._grow(end)
        behind = self.end + RECORD.size
        old, self.end = self.end, end
        try:
            self._put(behind, records[RECORD.size :] + self._gap())
            self._put(old, records[: RECORD.size])
        except OSError:
            self.end = old
            raise

    def _grow(self, end: int) -> None:
        size = -(-(end + ROOM) // PAGE) * PAGE
        self._put(size - len(ENDING), ENDING)  # the gap and the old ending still come first
        os.posix_fallocate(self.handle, self.size, size - self.size)
        self.size = size
        self._put(self.end, self._gap())

    def _gap(self) -> bytes:
        """What the gap begins with."""
        return RECORD.pack(PRIVATE, self.size - len(ENDING) - self.end - RECORD.size)

    def _filler(self, end: int) -> bytes:
        """A record that moves what begins at `end` away from the boundary of two pages, where it would lie across."""
        return RECORD.pack(PRIVATE, RECORD.size) + bytes(RECORD.size) if end % PAGE > PAGE - RECORD.size else b""

    def _put(self, at: int, data: bytes) -> None:
        while data:
            done = os.pwrite(self.handle, data, at)
            at, data = at + done, data[done:]
