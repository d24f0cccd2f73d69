"""A browser without a window: Chromium through its WebDriver, where both are installed (on Debian: chromium-driver)."""

import base64
import io
import json
import shutil
import subprocess
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from helpers_waiting import PATIENCE
from PIL import Image

from crash_estimator.viewer.sinks import usable_port

OPTIONS = (
    "--headless=new",
    "--no-sandbox",  # it shows what the test has made, and tests may run as root
    "--disable-dev-shm-usage",
    "--use-gl=angle",
    "--use-angle=swiftshader",  # WebGL by the processor
    "--enable-unsafe-swiftshader",
    "--hide-scrollbars",
)


DRAWING = 300.0
"""s for a page that a processor draws beside other work: nothing answers meanwhile."""


class Browser:
    """One page at a time."""

    def __init__(self, driver: str):
        """driver: its address."""
        self.driver = driver
        chrome = {"binary": shutil.which("chromium") or shutil.which("google-chrome"), "args": [*OPTIONS]}
        capabilities = {"browserName": "chrome", "goog:chromeOptions": chrome}
        found = self._call("POST", "/session", {"capabilities": {"alwaysMatch": capabilities}})
        self.session = f"/session/{found['sessionId']}"

    def open(self, url: str, size: tuple[int, int] = (1600, 900), theme: str = "dark") -> None:
        """theme: what the system is said to have, dark or light."""
        media = {"features": [{"name": "prefers-color-scheme", "value": theme}]}
        self._chrome("Emulation.setEmulatedMedia", media)
        metrics = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False}
        self._chrome("Emulation.setDeviceMetricsOverride", metrics)
        self._call("POST", f"{self.session}/url", {"url": url})

    def whole_page(self, height: int) -> list[np.ndarray]:
        """Pictures of the open page from its top to its end."""
        tall, pictures = self.run("return document.documentElement.scrollHeight"), []
        for top in range(0, tall, height):
            self.run(f"window.scrollTo(0, {top})")
            pictures.append(self.picture())
        return pictures

    def run(self, script: str):
        """What a script in the page returns."""
        return self._call("POST", f"{self.session}/execute/sync", {"script": script, "args": []})

    def picture(self) -> np.ndarray:
        """(height, width, 3) of the page as it is now."""
        png = base64.b64decode(self._call("GET", f"{self.session}/screenshot"))
        return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))

    def settled_picture(self, shows, patience: float = DRAWING) -> np.ndarray:
        """The first picture that `shows` is true of and that stays as it is."""
        deadline, before, moved = time.monotonic() + patience, None, 0
        while time.monotonic() < deadline:
            moved += 1
            try:  # without anything that happens a page without a window is not drawn anew
                self._chrome("Input.dispatchMouseEvent", {"type": "mouseMoved", "x": 600 + moved % 9, "y": 50})
                picture = self.picture()
            except urllib.error.HTTPError:  # it has too much to do with drawing to give one
                continue
            if before is not None and shows(picture) and np.array_equal(picture, before):
                return picture
            before = picture
            time.sleep(1.0)
        pytest.fail(f"the page does not show it within {patience:g} s")

    def close(self) -> None:
        self._call("DELETE", self.session)

    def _chrome(self, command: str, parameters: dict) -> None:
        self._call("POST", f"{self.session}/goog/cdp/execute", {"cmd": command, "params": parameters})

    def _call(self, method: str, path: str, content: dict | None = None):
        data = None if content is None else json.dumps(content).encode()
        request = urllib.request.Request(self.driver + path, data, {"Content-Type": "application/json"}, method=method)
        with urllib.request.urlopen(request, timeout=DRAWING) as answer:
            return json.load(answer)["value"]


@contextmanager
def browser() -> Iterator[Browser]:
    """Skips the test where there is none."""
    driver = shutil.which("chromedriver")
    if driver is None:
        pytest.skip("there is no browser that a test could look with: apt install chromium chromium-driver")
    port = usable_port(0)
    process = subprocess.Popen([driver, f"--port={port}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield from _session(f"http://127.0.0.1:{port}")
    finally:
        process.terminate()
        process.wait(PATIENCE)


def _session(address: str) -> Iterator[Browser]:
    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            with urllib.request.urlopen(f"{address}/status", timeout=5.0):
                break
        except OSError:
            assert time.monotonic() < deadline, "the browser's driver does not answer"
            time.sleep(0.1)
    one = Browser(address)
    try:
        yield one
    finally:
        one.close()
