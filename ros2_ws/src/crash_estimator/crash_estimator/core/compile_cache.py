"""Where numba keeps its compiled code: a folder of its own for every state of the sources it is made of.

numba looks only at the file of a cached function, not at the functions and constants it takes from other
files: after an update it would go on running old code. Import this before defining a compiled function.
"""

import hashlib
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from numba import config
from numba.core.event import Event, Listener, install_listener

INDEPENDENT = {"diagnosis", "effects"}
"""Folders of the core that the compiled recursion takes nothing from; numba sees each change of what they compile
but those of constants from another file."""
CONSTANTS = ("diagnosis/parameterization/layout.py",)
"""Files within that have such constants."""


def sources(core: Path) -> list[Path]:
    """The files after whose change all is compiled anew."""
    others = (path for path in core.rglob("*.py") if not INDEPENDENT & set(path.relative_to(core).parts))
    return sorted([*others, *(core / name for name in CONSTANTS)])


def _fingerprint(core: Path) -> str:
    return hashlib.sha256(b"".join(path.read_bytes() for path in sources(core))).hexdigest()[:16]


_cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "crash_estimator"
if not os.environ.get("NUMBA_CACHE_DIR"):
    config.CACHE_DIR = str(_cache / _fingerprint(Path(__file__).parent))  # type: ignore[attr-defined]  # numba's own


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
