"""Where numba keeps its compiled code: a folder of its own for every state of the sources it is made of.

numba looks only at the file of a cached function, not at the functions and constants it takes from other
files: after an update it would go on running old code. Import this before defining a compiled function.
"""

import hashlib
import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from numba import config
from numba.core.event import Event, Listener, install_listener


def sources(core: Path) -> list[Path]:
    """The files of the compiled recursion, and those that it takes constants from: after any other change the code that
    is there goes on being used. (The compiled functions elsewhere, of diagnosis and effects, take nothing from others.)
    """
    texts = {file: file.read_text() for file in sorted((core / "compiled").glob("*.py"))}
    compiled = [file for file, text in texts.items() if "@njit" in text]
    names = {name for file in compiled for name in re.findall(r"^from \.\.([\w.]+) import", texts[file], re.MULTILINE)}
    return [*compiled, *(core.joinpath(*name.split(".")).with_suffix(".py") for name in sorted(names))]


def _fingerprint(core: Path) -> str:
    return hashlib.sha256(b"".join(path.read_bytes() for path in sources(core))).hexdigest()[:16]


_cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "crash_estimator"
if not os.environ.get("NUMBA_CACHE_DIR"):
    config.CACHE_DIR = str(_cache / _fingerprint(Path(__file__).parent))


class _Once(Listener):
    def __init__(self, say: Callable[[str], object]):
        self.say, self.said = say, False

    def on_start(self, event: Event) -> None:
        if not self.said:
            self.said = True
            self.say("compiling code that is not in the cache: this first start takes up to a minute longer")

    def on_end(self, event: Event) -> None:
        pass


@contextmanager
def compiling_said(say: Callable[[str], object]) -> Iterator[None]:
    """Say one line if anything must be compiled within, as no set-up or earlier start has done it."""
    with install_listener("numba:compile", _Once(say)):
        yield
