"""A picture of a Rerun recording without a screen: python -m crash_estimator.viewer.screenshot run.rrd run.png"""

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rerun.experimental import ViewerClient

from crash_replay.fault import Fault, guarded
from crash_replay.output import check_outputs, write_bytes
from crash_replay.said import Parser

from .native import viewer_binary
from .pen import TIMELINE
from .sinks import usable_port

LIBRARIES = (
    "mesa-vulkan-drivers libvulkan1 libgl1-mesa-dri libegl1 libgl1 libxkbcommon-x11-0 libxcursor1 libxi6 libxrandr2 "
    "fonts-dejavu-core"
)
"""Debian packages that drawing without a screen takes."""

SIZE = (1600, 900)
"""Pixels, of a usual screen: what can be read on it must be readable."""
PATIENCE = 60.0
"""s for each of three steps."""


class ScreenshotError(Fault):
    """The viewer did not start or did not draw; the message is one readable line."""


def screenshot(
    rrd: str | Path,
    png: str | Path,
    at: float | None = None,
    size: tuple[int, int] = SIZE,
    patience: float = PATIENCE,
) -> None:
    """Draw a recording as the viewer would show it, the time cursor at `at` s since the impact (None: at the end).

    Raises ScreenshotError where no viewer can run; what it needs is in LIBRARIES. OutputError: it cannot be written.
    """
    png = Path(png).absolute()
    with _viewer_of(Path(rrd), at, size, patience) as viewer:
        write_bytes(png, _settled_picture(viewer, time.monotonic() + patience))


def screenshots(
    rrd: str | Path,
    folder: str | Path,
    at: float | None = None,
    size: tuple[int, int] = SIZE,
    patience: float = PATIENCE,
) -> dict[str, Path]:
    """A picture of every tab, `missing_effect.png` of "Missing effect" -> those written, by tab; as `screenshot`."""
    folder, written = Path(folder).absolute(), {}
    folder.mkdir(parents=True, exist_ok=True)
    with _viewer_of(Path(rrd), at, size, patience) as viewer:
        layout = viewer.get_blueprint().blueprint
        root = layout[f"/container/{layout['/viewport']['ViewportBlueprint']['root_container']}"]["ContainerBlueprint"]
        for tab in root["contents"]:
            name = layout[f"/{tab}"]["ContainerBlueprint"]["display_name"]
            root["active_tab"] = tab
            viewer.set_blueprint(layout, "recording")
            written[name] = folder / f"{name.lower().replace(' ', '_')}.png"
            write_bytes(written[name], _settled_picture(viewer, time.monotonic() + patience))
    return written


@contextmanager
def _viewer_of(rrd: Path, at: float | None, size: tuple[int, int], patience: float) -> Iterator[ViewerClient]:
    """A viewer without a window that has loaded the recording."""
    rrd = rrd.resolve()
    if not rrd.is_file():
        raise ScreenshotError(f"{rrd}: no such recording")
    port = usable_port(0)
    command = [
        viewer_binary(),
        "--headless",
        f"--window-size={size[0]}x{size[1]}",
        "--bind=127.0.0.1",
        f"--port={port}",
        "--hide-welcome-screen",
    ]
    quiet = {**os.environ, "RUST_LOG": "error", "RERUN_APP_ONLY": "true"}  # messages would pop up in the picture
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=quiet) as process:
        try:
            viewer = _connected(process, f"rerun+http://127.0.0.1:{port}/proxy", time.monotonic() + patience)
            viewer.open(str(rrd))
            _wait_until_loaded(viewer, time.monotonic() + patience)
            if at is not None:
                viewer.set_time(TIMELINE, duration=at, play_state="paused")
            yield viewer
        except ConnectionError as error:  # it had answered: where it cannot draw it stops a moment later
            raise _stopped(process) from error
        finally:
            process.terminate()


def _connected(process: subprocess.Popen, url: str, deadline: float) -> ViewerClient:
    while time.monotonic() < deadline:
        if process.poll() is not None:
            raise _stopped(process)
        try:
            viewer = ViewerClient.connect(url)
            viewer.get_state()
            return viewer
        except ConnectionError:
            time.sleep(0.1)
    raise ScreenshotError(f"the Rerun viewer did not answer at {url}")


def _stopped(process: subprocess.Popen) -> ScreenshotError:
    """With what it said of its end, which stands before its stack and its addresses for help."""
    process.terminate()
    said = process.stderr.read().decode(errors="replace").strip().splitlines() or ["nothing"]
    reason = next((line for line in said if "panicked" in line or "error" in line.lower()), said[-1]).strip()
    return ScreenshotError(f"the Rerun viewer stopped, saying: {reason} (it needs: apt install {LIBRARIES})")


def _wait_until_loaded(viewer: ViewerClient, deadline: float) -> None:
    while time.monotonic() < deadline:
        state = viewer.get_state()
        if not state.loading and any(recording.timelines for recording in state.recordings):
            return
        time.sleep(0.1)
    raise ScreenshotError("the Rerun viewer did not finish loading the recording")


def _settled_picture(viewer: ViewerClient, deadline: float) -> bytes:
    """PNG: views fill over some frames after the data are there, and show dots that move as long as they do."""
    before = b""
    while time.monotonic() < deadline:
        time.sleep(0.4)
        picture = viewer.take_screenshot()
        if picture == before:
            return picture
        before = picture
    raise ScreenshotError("the Rerun viewer did not finish drawing")


def main(argv: list[str] | None = None) -> int:
    return guarded(lambda: _command(argv))


def _command(argv: list[str] | None) -> None:
    parser = Parser(prog="screenshot", description="Draw a Rerun recording into a PNG file.")
    parser.add_argument("rrd")
    parser.add_argument("png", help="with --every-tab: a folder")
    parser.add_argument("--at", type=float, help="time cursor, s since the impact (default: the end)")
    parser.add_argument("--size", default="1600x900", help="WIDTHxHEIGHT in pixels")
    parser.add_argument("--patience", type=float, default=PATIENCE, help="s for each of three steps (default: 60)")
    parser.add_argument("--every-tab", action="store_true", help="a picture of each tab, named after it")
    arguments = parser.parse_args(argv)
    width, _, height = arguments.size.partition("x")
    if not (width.isdigit() and height.isdigit()):
        parser.error(f"--size must be WIDTHxHEIGHT such as 1600x900, got {arguments.size!r}")
    size = int(width), int(height)
    if arguments.every_tab:
        screenshots(arguments.rrd, arguments.png, arguments.at, size, arguments.patience)
    else:
        check_outputs({"PNG": arguments.png}, [arguments.rrd])
        screenshot(arguments.rrd, arguments.png, arguments.at, size, arguments.patience)


if __name__ == "__main__":
    sys.exit(main())
