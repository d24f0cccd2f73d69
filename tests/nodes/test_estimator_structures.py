"""Every structure's recording, live from the real replay: the estimators say what the loop gives."""

from math import ceil

import pytest
from helpers_estimator_node import assert_same, joined, offline
from helpers_paths import BAGS

from crash_replay.bag import read_bag


@pytest.mark.parametrize(
    ("bag", "name", "block"),
    [
        ("frontal_single", "frontal_single", 10),
        ("frontal_engine_cab", "frontal_engine_cab", 1),
        ("side_mdb_door_car", "side_mdb_door_car", 10),
        ("side_dummy_padded", "side_dummy", 10),
        ("impactor_single", "impactor_single", 10),
    ],
)
def test_each_structure_live_from_the_real_replay(stage, bag, name, block):
    """No sample lost, the loop's numbers to the last bit, no stiffness ever negative; three methods side by side.

    One sample a message from one of them: it is the messages that take time, and they know of no structure.
    """
    methods = ("rls", "mrls", "constrained_kalman")
    for method in methods:
        stage.add_estimator(method, model=name, method=method)
    path = BAGS / f"{bag}.mcap"
    stage.replay(path, wait_for=len(methods), rate=0.5, block=block)
    recording = read_bag(path)
    for method in methods:
        heard = stage.wait_for(method, ceil(len(recording) / block))
        assert not [event for event in heard["events"] if event.kind == "lost"]
        assert_same(heard, offline(name, recording, method))
        is_stiffness = [parameter.endswith(".stiffness") for parameter in heard["parameters"][0].name]
        assert joined(heard["parameters"], "value")[:, is_stiffness].min() >= 0.0
