"""`demo` with its search for what is missing: the same answer from one that was stopped, none from a killed one."""

import os
import signal

from helpers_demo import demo  # noqa: F401  the fixture

FAST = ("--no-viewer", "--rate", "0.05")


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
