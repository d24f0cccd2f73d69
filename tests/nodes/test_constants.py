"""Constants of the messages are what the nodes say: words and numbers of each enumeration, no more and no fewer.

What a diagnosis says of them is in test_diagnosis_node.py.
"""

import ast

import numpy as np
import pytest
from crash_msgs.msg import (
    Event,
    Forces,
    Listener,
    MisfitWindow,
    Parameter,
    ParametersBlock,
    Ranking,
    ReplayState,
)  # fmt: skip
from crash_msgs.srv import AddEffect
from helpers_estimation import oscillator_recording
from helpers_estimator_node import UNDAMPED
from helpers_paths import ROOT

from crash_estimator.core import diagnosis
from crash_estimator.core.estimate import ElementState, ParameterStatus
from crash_replay.attendance import State
from crash_replay.player import Mode
from crash_replay.qos import EVENTS

ESTIMATOR = ROOT / "ros2_ws" / "src" / "crash_estimator" / "crash_estimator"


def constants(message: type, kind: type) -> dict[str, object]:
    """Name -> value of a message's constants of a Python type."""
    found = {name: getattr(message, name) for name in dir(message) if name.isupper() and not name.startswith("_")}
    return {name: value for name, value in found.items() if type(value) is kind}


@pytest.mark.parametrize(
    ("message", "members"),
    [
        (Parameter, ParameterStatus), (ParametersBlock, ParameterStatus), (Forces, ElementState),
        (Listener, State), (ReplayState, Mode),
    ],
)  # fmt: skip
def test_numbers_are_those_of_the_code(message, members):
    assert constants(message, int) == {one.name: int(one) for one in members}


def test_words_are_their_names_in_small_letters():
    for message in (Event, MisfitWindow, Ranking):
        said = constants(message, str)
        assert said and said == {name: name.lower() for name in said}


def test_verdicts_and_states_of_a_misfit_are_those_of_the_code():
    assert set(constants(Ranking, str).values()) == {
        diagnosis.EFFECT_MISSING, diagnosis.ADEQUATE, diagnosis.UNEXPLAINED
    }  # fmt: skip
    assert set(constants(MisfitWindow, str)) == {state.name for state in ElementState}


def test_kinds_of_events_are_all_that_the_code_says():
    """Wherever an `Event` is made, or the node's topics are told of one: a word, or the state of an element."""
    said = {state.name.lower() for state in ElementState}
    for file in ESTIMATOR.rglob("*.py"):
        calls = [node for node in ast.walk(ast.parse(file.read_text())) if isinstance(node, ast.Call) and node.args]
        for call in calls:
            name = getattr(call.func, "id", getattr(call.func, "attr", ""))
            if name in ("Event", "event") and isinstance(call.args[0], ast.Constant):
                said.add(call.args[0].value)
    assert said == set(constants(Event, str).values())


def test_an_estimator_says_them_and_who_comes_late_hears_them(stage, tmp_path):
    """All its events, in their order; each with its model as frame."""
    recording = oscillator_recording(noise=5.0, n=300)
    recording.values[200:203, 0] = np.nan
    (tmp_path / "model.yaml").write_text(UNDAMPED)
    stage.add_estimator("one", model=str(tmp_path / "model.yaml"), method="mrls")
    stage.send_test(recording)
    stage.send(recording, 0, 250)
    stage.send(recording, 260, 300)
    heard = stage.wait_for("one", 290)["events"]
    assert stage.call(AddEffect, "one/add_effect", effect="viscous_damping", target="spring").success
    stage.spin_until(lambda: heard[-1].kind == Event.EFFECT, "the change is told")
    kinds = {event.kind for event in heard}
    assert kinds >= {"loading", "rewound", "dropout", "lost", "effect"}
    assert kinds <= set(constants(Event, str).values())
    assert {event.header.frame_id for event in heard} == {"oscillator"}
    late: list[Event] = []
    stage.node.create_subscription(Event, "one/events", late.append, EVENTS)
    stage.spin_until(lambda: len(late) == len(heard), "the late one has heard all")
    assert late == heard
