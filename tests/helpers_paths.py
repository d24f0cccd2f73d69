"""Where things are: the project, its recordings, and real ones in a folder beside it, or where CRASH_DATA says."""

import os
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ROOT / "ros2_ws" / "src"
BAGS = ROOT / "bags"
DATA = Path(os.environ.get("CRASH_DATA") or ROOT.parent / "shared" / "data")
