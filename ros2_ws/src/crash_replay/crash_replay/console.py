"""The terminal's side of `replay`: keys in, a progress line out, in a thread of its own."""

import math
import shutil
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from threading import Thread
from typing import Any, TextIO

from .foreign_text import visible, visible_lines
from .keyboard import Keyboard
from .keys import HELP, next_rate
from .pacing import Pacing
from .player import SECOND, CommandError, Player

PERIOD = 0.1
"""Seconds between two drawings of the progress line."""
SHOWN = 3.0
"""Seconds for which the answer to a key stands in the progress line."""
ERASE = "\r\x1b[K"
FAR = 10
"""Samples that a step with shift goes."""


def progress_line(player: Player, rate: float) -> str:
    """Time, share, run, rate asked for and kept, state; the share counts from the window's first sample."""
    sent = player.next - player.first
    share = sent / (player.end - player.first)
    time_ns = player.time_ns[min(player.next, player.end - 1)]
    window = "" if player.end - player.first == len(player.time_ns) else " of the window"
    return (
        f"{player.mode.name.lower():8} {time_ns / SECOND * 1e3:9.3f} ms  {share:4.0%}{window}  sample {player.next} of "
        f"{len(player.time_ns)}  rate {player.rate:g} ({rate:.3g} kept)"
        + (f"  run {player.run}" if player.run else "")
        + ("  loop" if player.loop else "")
    )


class Console:
    """Use as a context, in the main thread. A progress line goes to `stream`, which need not be a terminal."""

    def __init__(
        self,
        pacing: Pacing,
        set_parameters: Callable[[dict[str, Any]], str],
        keyboard: bool,
        progress: bool,
        stream: TextIO = sys.stderr,
    ):
        """set_parameters: changes them as `ros2 param set` does and says why not, or ""."""
        self.pacing, self.set_parameters, self.stream = pacing, set_parameters, stream
        self.keyboard = Keyboard() if keyboard else None
        self.progress = progress
        self.answer, self.answered_at = "", -math.inf
        self.drawn = ""
        self.over = False
        self.contexts = ExitStack()
        self.thread = Thread(target=self._run, daemon=True)

    def __enter__(self) -> "Console":
        if self.keyboard:
            self.contexts.enter_context(self.keyboard)
            self.say(HELP)
        if self.keyboard or self.progress:
            self.thread.start()
        return self

    def __exit__(self, *_) -> None:
        self.over = True
        try:
            if self.thread.ident:
                self.thread.join()
            if self.progress:
                self._draw(self._progress())
                self._write("\n")
        finally:
            self.contexts.close()

    def say(self, line: str) -> None:
        """A line that stays, above the progress line."""
        self._write((ERASE if self.drawn else "") + visible_lines(line) + "\n" + self.drawn)

    def _run(self) -> None:
        while not self.over:
            if self.keyboard:
                for key in self.keyboard.pressed(PERIOD):
                    self._on_key(key)
            else:
                time.sleep(PERIOD)
            if self.progress:
                fresh = time.monotonic() - self.answered_at < SHOWN
                line = self._progress()
                self._draw(f"{self.answer}; {line}" if fresh and self.answer else line)

    def _progress(self) -> str:
        return progress_line(self.pacing.player, self.pacing.rate_now())

    def _draw(self, line: str) -> None:
        line = visible(line)[: shutil.get_terminal_size().columns - 1]
        if line != self.drawn:
            self.drawn = line
            self._write(ERASE + line)

    def _write(self, text: str) -> None:
        try:
            self.stream.write(text)
            self.stream.flush()
        except (OSError, ValueError):  # the terminal is gone; the replay goes on
            self.progress = False

    def _on_key(self, key: str) -> None:
        try:
            self.answer = self._follow(key) or ""
        except CommandError as error:
            self.answer = str(error)
        self.answered_at = time.monotonic()

    def _follow(self, key: str) -> str | None:
        """Do what a key says; what to tell about it."""
        pacing, player = self.pacing, self.pacing.player
        if key == "space":
            pacing.command(Player.toggle)
        elif key.endswith(("right", "left")):
            n = FAR if key.startswith("shift") else 1
            pacing.command(Player.step, n if key.endswith("right") else -n)
        elif key in ("up", "down"):
            return self.set_parameters({"rate": next_rate(player.rate, key == "up")})
        elif key.isdecimal() or key == "home":
            share = 0.0 if key == "home" else int(key) / 10
            pacing.command(Player.seek, player.time_ns.item(player.first + int(share * (player.end - player.first))))
        elif key == "end":
            pacing.command(Player.seek, player.time_ns.item(player.end - 1))
        elif key == "l":
            return self.set_parameters({"loop": not player.loop})
        elif key in ("a", "b"):
            here = player.time_ns.item(min(player.next, len(player.time_ns) - 1)) / SECOND
            return self.set_parameters({"from": here} if key == "a" else {"until": here, "loop": True})
        elif key == "c":
            return self.set_parameters({"from": -math.inf, "until": math.inf})
        elif key == "q":
            pacing.stopped = True
        elif key in ("h", "?"):
            self.say(HELP)
        else:
            return f"no such key: {key!r}; h lists them"
        return None


def wanted(value: str, stream: TextIO) -> bool:
    """Whether the parameter progress or keyboard, auto, true or false, asks for it on this stream."""
    return value == "true" or (value == "auto" and stream.isatty())
