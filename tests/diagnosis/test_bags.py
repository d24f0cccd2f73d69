"""What is said of the recordings in bags/: with a model that lacks nothing, and with one that does."""

from dataclasses import replace

import pytest
from helpers_paths import ROOT

from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.structure import Coefficient
from crash_estimator.model_file import load_model
from crash_replay.bag import read_bag

OWN = {
    "frontal_single": "bags/frontal_single.whole.yaml",
    "frontal_engine_cab": "bags/frontal_engine_cab.whole.yaml",
    "frontal_abrupt": "bags/frontal_abrupt.whole.yaml",
    "side_mdb_door_car": "bags/side_mdb_door_car.whole.yaml",
    "side_abrupt": "bags/side_mdb_door_car.whole.yaml",
    "side_dummy_padded": "side_dummy",
    "side_dummy_unpadded": "side_dummy",
    "impactor_single": "impactor_single",
}
"""Of each recording in bags/ but `hidden_effect`."""


def recording(name: str):
    return read_bag(ROOT / "bags" / f"{name}.mcap")


def model(name: str):
    return load_model(ROOT / name if "/" in name else name)


def test_every_recording_has_its_model():
    assert {path.stem for path in (ROOT / "bags").glob("*.mcap")} == {*OWN, "hidden_effect"}


@pytest.mark.parametrize("name", OWN)
def test_a_model_that_lacks_nothing_is_adequate(name):
    found = diagnose(model(OWN[name]), [recording(name)])
    assert (found.verdict, found.complete, found.steps) == ("adequate", True, ())


def test_an_unloading_stiffness_that_the_model_leaves_open_is_fitted_and_not_missing():
    whole = model(OWN["frontal_single"])
    (element,) = whole.elements
    left_open = replace(element, unloading=None, unloading_slope=Coefficient(0.25 * element.unloading, True))
    found = diagnose(replace(whole, elements=(left_open,)), [recording("frontal_single")])
    assert (found.verdict, found.complete, found.steps) == ("adequate", True, ())
    (fitted,) = (one for one in found.constants if one.constant == "unloading")
    assert abs(fitted.value - element.unloading) < 4.0 * fitted.std < 0.05 * element.unloading


def test_what_both_structures_of_a_car_lack_is_named_on_both():
    """Neither unloading line counts while the other one is missing; found one by one, other effects come first."""
    whole = model(OWN["frontal_abrupt"])
    elastic = [replace(e, unloading=None, tension=True, acts_when_spent="nothing") for e in whole.elements]
    found = diagnose(replace(whole, elements=tuple(elastic)), [recording("frontal_abrupt")])
    named = {(step.effect, step.target) for step in found.steps}
    assert named == {("plastic_unloading", "cab_barrier"), ("plastic_unloading", "engine_barrier")}
    assert (found.verdict, found.complete) == ("effect_missing", True)
