"""Where things are: the project's root, its recordings, and the real ones that are beside it in the workshop."""

import os
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ROOT / "ros2_ws" / "src"
BAGS = ROOT / "bags"
DATA = Path(os.environ.get("CRASH_DATA") or ROOT.parent / "shared" / "data")
