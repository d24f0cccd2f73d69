"""`demo` with its search for what is missing: the same answer from one that was stopped, none from a killed one."""

import os
import re
import signal

import pytest
from helpers_demo import demo  # noqa: F401  the fixture
from helpers_paths import DATA

FAST = ("--no-viewer", "--rate", "0.05")
SHOTS = [DATA / f"cyberdiver/linear_damped__15npmm_{speed}mps_025damping_trial1.csv" for speed in (4, 6)]


def answer_in(said: str) -> list[str]:
    """What is told once all samples have been judged, without what was waited for."""
    lines = said.splitlines()
    begins = ("all samples", "where it fails", "what it lacks", "the error falls", "verdict", "added to")
    return sorted(line for line in lines if line.startswith(begins))


def test_the_answer_is_the_same_though_the_diagnosis_was_stopped(demo):  # noqa: F811
    """To the last digit; without a stop it is told in tests/project/test_readme_demo.py."""
    show = demo(*FAST)
    show.wait_for_samples()
    show.stop("/diagnosis ", 8.0)
    assert show.end() == 0, show.said()
    answer = answer_in(show.said())
    assert len(answer) == 6, show.said()
    assert "what it lacks: coulomb_friction on rib_spine, 1413 ± 6 N; evidence 23162 nats, explains 94%" in answer
    added = "revision 1: dummy with coulomb_friction on rib_spine; 1401 samples estimated again"
    assert f"added to hidden_effect: {added}" in answer


def test_a_diagnosis_that_was_killed_gives_no_answer_and_the_last_line_says_so(demo):  # noqa: F811
    show = demo(*FAST)
    show.wait_for_samples()
    os.kill(show.child("/diagnosis "), signal.SIGKILL)
    assert show.end() == 1, show.said()
    assert not show.left_over()
    assert show.last_line().startswith("incomplete: diagnosis has ended too early: ")
    assert "no answer of the diagnosis" in show.last_line()


@pytest.mark.skipif(not SHOTS[0].is_file(), reason=f"no recordings in {DATA}")
def test_the_programmed_damper_is_found_in_two_recordings_of_hardware(demo):  # noqa: F811
    """Within 15 % of its 23.4 N s/m (the recordings' README), as in single recordings (test_diagnosis_real)."""
    show = demo(*FAST, "--recording", str(SHOTS[0]), "--with", str(SHOTS[1]))
    assert show.end() == 0, show.said()
    found = re.search(r"^what it lacks: viscous_damping on spring, ([\d.]+) ± ([\d.]+) N\*s/m", show.said(), re.M)
    assert found, show.said()
    assert float(found.group(1)) == pytest.approx(23.4, rel=0.15)
    assert float(found.group(2)) < 1.0, "the first alone tells it to 1.1 N s/m, both to 0.7"
    before, after = re.search(r"^the error falls: ([\d.]+) -> ([\d.]+) g", show.said(), re.M).groups()
    assert float(after) < 0.5 * float(before)
