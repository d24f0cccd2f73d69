"""Work that steps back for others."""

import subprocess
import sys

import pytest

from crash_replay.scheduling import AUTOGROUP

SAY = """
from crash_replay.scheduling import AUTOGROUP, step_back
step_back(10)
print(AUTOGROUP.read_text().split()[-1])
"""


def the_kernel_groups_by_session() -> bool:
    return AUTOGROUP.exists() and AUTOGROUP.read_text() != ""  # empty: it could, and does not


@pytest.mark.skipif(not the_kernel_groups_by_session(), reason="the kernel does not group processes by session")
def test_only_a_session_of_its_own_steps_back():
    """In a session with others, these would step back too."""

    def niceness(own: bool) -> str:
        done = subprocess.run([sys.executable, "-c", SAY], start_new_session=own, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    before = AUTOGROUP.read_text().split()[-1]
    assert niceness(own=False) == before
    assert niceness(own=True) == "10"
