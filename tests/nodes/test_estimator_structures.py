"""Every structure's recording, live from the real replay: the estimators say what the loop gives."""

import pytest
from helpers_estimator_node import assert_same, joined, offline
from helpers_paths import BAGS

from crash_replay.bag import read_bag


@pytest.mark.parametrize(
    ("bag", "name"),
    [
        ("frontal_single", "frontal_single"),
        ("frontal_engine_cab", "frontal_engine_cab"),
        ("side_mdb_door_car", "side_mdb_door_car"),
        ("side_dummy_padded", "side_dummy"),
        ("impactor_single", "impactor_single"),
    ],
)
def test_each_structure_live_from_the_real_replay(stage, bag, name):
    """No sample lost, the loop's numbers to the last bit, no stiffness ever negative; three methods side by side."""
    methods = ("rls", "mrls", "constrained_kalman")
    for method in methods:
        stage.add_estimator(method, model=name, method=method)
    path = BAGS / f"{bag}.mcap"
    stage.replay(path, wait_for=len(methods), rate=0.5)
    recording = read_bag(path)
    for method in methods:
        heard = stage.wait_for(method, len(recording))
        assert not [event for event in heard["events"] if event.kind == "lost"]
        assert_same(heard, offline(name, recording, method))
        is_stiffness = [parameter.endswith(".stiffness") for parameter in heard["parameters"][0].name]
        assert joined(heard["parameters"], "value")[:, is_stiffness].min() >= 0.0
