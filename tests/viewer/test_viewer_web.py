"""Rerun's web viewer, where there is no display: served on the loopback, live, and readable in both themes."""

import os
import subprocess
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import helpers_viewer as crash_data
import numpy as np
import pytest
from helpers_browser import Browser, browser
from helpers_findings import story
from helpers_paths import ROOT
from helpers_ports import bound, elsewhere
from helpers_viewer import settle, start_viewer
from helpers_waiting import PATIENCE
from PIL import Image

from crash_estimator.viewer.colors import MEASURED, REVISION_COLORS, TOLD
from crash_estimator.viewer.recorder import Recorder
from crash_estimator.viewer.sinks import Sinks
from crash_estimator.viewer.web import WebFile, WebViewer
from crash_replay.processes import has_ended

SHORT = 300
"""Samples: a processor draws them in half a minute."""


@pytest.fixture(scope="module")
def page(tmp_path_factory) -> Iterator[str]:
    """Of a viewer that has drawn an estimator and a diagnosis, and is still open."""
    crash = crash_data.simulate(n=SHORT)
    target = Recorder(Sinks(0, tmp_path_factory.mktemp("web") / "crash.rrd"), ("ckf",), say=pytest.fail)
    web = WebViewer(target.sinks.url)
    target.put(lambda: crash_data.test_block(crash))
    for item in [*story(crash), *crash_data.estimates(crash, "ckf")]:
        target.put(lambda item=item: item)
    settle(target)
    yield web.page
    web.close()
    target.close()


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    with browser() as one:
        yield one


def count(picture: np.ndarray, color: tuple[int, int, int], tolerance: int = 25) -> int:
    return int((np.abs(picture.astype(int) - np.array(color)).max(axis=2) <= tolerance).sum())


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_a_browser_shows_it_in_either_theme(page, chromium, theme):
    """The pictures are left in out/web, to be looked at."""
    chromium.open(f"{page}&renderer=webgl", theme=theme)
    picture = chromium.settled_picture(lambda shown: count(shown, REVISION_COLORS[0]) > 1000)
    folder = ROOT / "out/web"
    folder.mkdir(parents=True, exist_ok=True)
    Image.fromarray(picture).save(folder / f"{theme}.png")
    ground = np.median(picture, axis=(0, 1))
    assert (ground > 240).all() if theme == "light" else (ground < 30).all()
    plots, drawings = picture[60:, 440:1360], picture[60:, :430]
    for color in (MEASURED, *REVISION_COLORS[:2]):
        assert count(plots, color) > 300, f"{color} is not in the plots"
    assert count(drawings, TOLD) + count(drawings, REVISION_COLORS[0]) > 300
    corner = picture[570:800, 300:425]  # of a drawing, where nothing is drawn
    assert np.abs(np.median(corner, axis=(0, 1)) - ground).max() < 20, "a drawing has the theme's own ground"


def answered(url: str) -> bytes:
    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            with urllib.request.urlopen(url, timeout=PATIENCE) as answer:
                return answer.read()
        except OSError:
            assert time.monotonic() < deadline, f"{url} does not answer"
            time.sleep(0.1)


def test_it_listens_on_this_machine_only_and_ends(tmp_path):
    web = WebViewer("rerun+http://127.0.0.1:9876/proxy")
    try:
        assert web.page == f"http://127.0.0.1:{web.port}/?url=rerun%2Bhttp%3A%2F%2F127.0.0.1%3A9876%2Fproxy"
        assert b"Rerun" in answered(web.page)
        sockets = bound(web.process.pid)
        assert ("tcp", "127.0.0.1", web.port) in sockets and not elsewhere(sockets)
    finally:
        web.close()
    assert has_ended(web.process.pid)


def test_a_finished_file_is_served_with_its_page(tmp_path):
    crash = crash_data.simulate(n=60)
    target = Recorder(Sinks(0, tmp_path / "crash.rrd"), ("ckf",))
    target.put(lambda: crash_data.test_block(crash))
    for block in crash_data.estimates(crash, "ckf"):
        target.put(lambda block=block: block)
    target.close()
    web = WebFile(tmp_path / "crash.rrd")
    try:
        assert b"Rerun" in answered(web.page)
        sockets = bound(web.process.pid)
        assert len([one for one in sockets if one[0] == "tcp"]) == 2 and not elsewhere(sockets)
    finally:
        web.close()


def test_the_node_says_where_to_look_and_takes_the_page_with_it(tmp_path):
    environment = {name: os.environ.pop(name) for name in ("DISPLAY", "WAYLAND_DISPLAY") if name in os.environ}
    try:
        viewer = start_viewer(tmp_path / "web.rrd", web="true", web_port=0)
    finally:
        os.environ.update(environment)
    said = iter(viewer.stderr.readline, "")
    line = next(line for line in said if "in a browser" in line)
    url = line.split("in a browser on this machine: ")[1].strip()
    assert url.startswith("http://127.0.0.1:") and b"Rerun" in answered(url)
    (server,) = [int(pid) for pid in Path(f"/proc/{viewer.pid}/task/{viewer.pid}/children").read_text().split()]
    viewer.kill()  # even so nothing is left
    viewer.communicate(timeout=PATIENCE)
    deadline = time.monotonic() + PATIENCE
    while not has_ended(server):
        assert time.monotonic() < deadline, subprocess.run(["ps", str(server)], capture_output=True, text=True).stdout
        time.sleep(0.05)
