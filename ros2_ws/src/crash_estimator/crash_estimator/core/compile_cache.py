"""Where numba keeps its compiled code: a folder of its own for every state of the sources it is made of.

numba looks only at the file of a cached function, not at the functions and constants it takes from other
files: after an update it would go on running old code. Import this before defining a compiled function.
"""

import hashlib
import os
from pathlib import Path

from numba import config


INDEPENDENT = {"diagnosis", "effects"}
"""Folders of the core that the compiled recursion takes nothing from."""


def _fingerprint(folder: Path) -> str:
    sources = sorted(path for path in folder.rglob("*.py") if not INDEPENDENT & set(path.relative_to(folder).parts))
    return hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()[:16]


_cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "crash_estimator"
if not os.environ.get("NUMBA_CACHE_DIR"):
    config.CACHE_DIR = str(_cache / _fingerprint(Path(__file__).parent))
