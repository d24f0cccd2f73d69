"""Where the recordings go: a gRPC server that viewers connect to whenever they like, and .rrd files.

Two Rerun recordings for each pass over the test. The live one is written in small batches; the file in large ones, or
it would be ten times as large and slow to open. The server belongs to the first live recording and lives until the
end; later passes (a loop, a seek) are sent through the same server.
"""

import socket
import uuid
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb
from rerun import bindings

from crash_replay.foreign_text import visible
from crash_replay.output import OutputError, named

APPLICATION = "crash_estimator"
RERUN = b"RRF"
"""A Rerun recording begins with it."""


class Sinks:
    """Makes the recordings of one session."""

    def __init__(self, port: int = 9876, rrd: str | Path = "", memory_limit: str = "1GiB"):
        """port: of the server on 127.0.0.1, 0 or one in use: a free one is taken; rrd: no file where it is empty."""
        self.port = usable_port(port)
        self.url = f"rerun+http://127.0.0.1:{self.port}/proxy"
        self.rrd = Path(rrd).absolute() if str(rrd) else None
        self.memory_limit = memory_limit
        self.started, self.files = 0, 0
        if self.rrd:
            with named(self.rrd):
                self.rrd.parent.mkdir(parents=True, exist_ok=True)

    def open_live(self) -> rr.RecordingStream:
        recording = _recording()
        if self.started:
            recording.set_sinks(rr.GrpcSink(self.url))
        else:
            recording.set_sinks(rr.GrpcServerSink("127.0.0.1", self.port, server_memory_limit=self.memory_limit))
        self.started += 1
        return recording

    def open_file(self) -> tuple[rr.RecordingStream, Path] | None:
        """None where no file is wanted. Raises OutputError where it cannot be written."""
        if self.rrd is None:
            return None
        path = self.rrd if not self.files else self.rrd.with_stem(f"{self.rrd.stem}-{self.files + 1}")
        with named(path):  # Rerun would say so from another thread and go on without a file
            _check_replaceable(path)
            path.open("wb").close()
        recording = _recording()
        recording.set_sinks(rr.FileSink(str(path)))
        self.files += 1
        return recording, path


ALL_VIEWS = "view/5c0dca6a-e63f-9cf7-f657-2602590474cc"
"""Where Rerun keeps what all linked plots share (GLOBAL_VIEW_ID of its re_viewer_context); the SDK cannot say it."""


def send_layout(
    recording: rr.RecordingStream, layout: rrb.Blueprint, make_active: bool, times: tuple[float, float] | None = None
) -> None:
    """As `recording.send_blueprint` does, which for each layout leaves a recording in memory that holds itself.

    times: what the linked time axes show, s.
    """
    native = bindings.new_blueprint(
        application_id=APPLICATION, make_default=False, make_thread_default=False, default_enabled=True
    )
    written = rr.RecordingStream._from_native(native)
    written.set_time("blueprint", sequence=0)
    layout._log_to_stream(written)
    if times:
        start, end = (rr.TimeRangeBoundary.absolute(seconds=time) for time in times)
        written.log(f"{ALL_VIEWS}/TimeAxis", rrb.TimeAxis(view_range=rr.TimeRange(start=start, end=end)))
    bindings.send_blueprint(written.memory_recording().storage, make_active, True, recording=recording.to_native())
    written.disconnect()


def let_go() -> None:
    """Rerun keeps two threads and the buffers of every recording, of one that nobody holds too, until it is told so.

    See https://github.com/rerun-io/rerun/issues/2116.
    """
    bindings.flush_and_cleanup_orphaned_recordings()


def _check_replaceable(path: Path) -> None:
    """A bag, or whatever else the replay may read, is not lost by a slip of the hand."""
    if path.is_file() and path.stat().st_size:
        with path.open("rb") as file:
            if file.read(len(RERUN)) != RERUN:
                raise OutputError(f"{visible(path)} is no Rerun recording and is not replaced: give another name (rrd)")


def _recording() -> rr.RecordingStream:
    return rr.RecordingStream(APPLICATION, recording_id=str(uuid.uuid4()))


def usable_port(wanted: int) -> int:
    """The port itself if it is free on 127.0.0.1, otherwise any that is."""
    for port in (wanted, 0):
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return probe.getsockname()[1]
    raise OSError("no free port on 127.0.0.1")
