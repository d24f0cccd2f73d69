"""What cannot work on any test ends an estimator or a diagnosis with one line, before it has begun."""

import pytest

from crash_estimator.nodes import composed, diagnosis_node, estimator_node


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ([], "parameter model is not set"),
        (["-p", "model:=side_dumy"], "did you mean 'side_dummy'"),
        (["-p", "model:=side_dummy", "-p", "method:=krls"], "parameter method must be rls, mrls"),
        (["-p", "model:=side_dummy", "-p", "settings:=['forgetting=0.9']"], "there is no parameter settings: "),
        (["-p", "method:=rls", "-p", "settings.forgeting:=0.9"], "did you mean settings.forgetting?"),
        (["-p", "method:=rls", "-p", "settings.forgetting:=1.1"], "settings.forgetting must be a number from 0 to 1,"),
        (["-p", "method:=kalman", "-p", "settings.forgetting:=0.9"], "there is no parameter settings.forgetting"),
    ],
)
def test_an_estimator(node_ended, arguments, complaint):
    _one_line(*node_ended(estimator_node.main, "--ros-args", *arguments), complaint)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ([], "parameter model is not set"),
        (["-p", "model:=side_dumy"], "did you mean 'side_dummy'"),
        (["-p", "model:=side_dummy", "-p", "with_bags:=['none.mcap']"], "there is no such bag"),
        (["-p", "model:=side_dummy", "-p", "effects:=none.py"], "none.py"),
    ],
)
def test_a_diagnosis(node_ended, arguments, complaint):
    _one_line(*node_ended(diagnosis_node.main, "--ros-args", *arguments), complaint)


def test_an_estimator_that_is_composed(node_ended):
    _one_line(*node_ended(composed.main, "kalman"), "error: parameter model is not set: give a .yaml file")


def _one_line(status: int, _: str, errors: str, complaint: str) -> None:
    assert status == 1
    lines = errors.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith("error: ") and complaint in lines[0], errors
