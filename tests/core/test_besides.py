"""What a method knows besides the parameters reaches messages, JSON and terminal, with unit and sigma."""

import json

import numpy as np
import pytest
from crash_msgs.msg import Forces, ParametersBlock, ResidualsBlock
from helpers_estimation import oscillator, oscillator_recording
from numpy.testing import assert_array_equal
from rclpy.serialization import deserialize_message

from crash_estimator.cli.common import write_json
from crash_estimator.cli.work.estimate import as_json
from crash_estimator.core.errors import equation_errors
from crash_estimator.core.estimate import ParameterStatus
from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.structure import Coefficient
from crash_estimator.following.columns import columns_of
from crash_estimator.nodes.estimate_messages import EstimateMessages, description_from, estimates_from
from crash_estimator.tables import besides_table

BOTH = dict(stiffness=Coefficient(1.0e4, True, std=1.0e4), damping=Coefficient(0.0, True, std=100.0))
CASES = {
    "gauss_newton": (dict(p=1, q=1, memory=0.05), ("block.ar1", "block.ma1"), ("1", "1")),
    "afmm": (dict(models=2), ("model0.weight", "model0.jump", "model1.weight", "model1.jump"), ("1", "s", "1", "s")),
    "mrls": ({}, (), ()),
}


@pytest.fixture(scope="module", params=CASES)
def found(request):
    settings, names, units = CASES[request.param]
    recording = oscillator_recording(noise=5.0)
    estimator = make_estimator(oscillator(**BOTH), recording.test, request.param, **settings)
    assert (estimator.description.extra, estimator.description.extra_units) == (names, units)
    return recording, estimator.description, run(estimator, recording.samples())


def messages(description, estimates):
    make, columns = EstimateMessages(description), columns_of(estimates)
    said = {ParametersBlock: make.parameters, ResidualsBlock: make.residuals, Forces: make.forces}
    return tuple(deserialize_message(of_kind(0, 0, columns), kind) for kind, of_kind in said.items())


def test_it_travels_after_the_parameters_with_name_unit_and_sigma(found):
    _, description, estimates = found
    parameters = messages(description, estimates)[0]
    width = len(parameters.name)
    assert tuple(parameters.name) == description.parameters + description.extra
    assert tuple(parameters.unit) == description.parameter_units + description.extra_units
    value, std, status = (
        np.asarray(getattr(parameters, field)).reshape(-1, width) for field in ("value", "std", "status")
    )
    p = len(description.parameters)
    assert_array_equal(value[:, :p], [e.parameters for e in estimates])
    assert (status[:, p:] == ParameterStatus.METHOD).all() and (status[:, :p] != ParameterStatus.METHOD).all()
    if description.extra:
        assert_array_equal(value[:, p:], [e.extra for e in estimates])
        assert_array_equal(std[:, p:], [e.extra_std for e in estimates])


def test_the_status_is_that_of_the_message(found):
    parameters = messages(*found[1:])[0]
    assert {status.name: int(status) for status in ParameterStatus} == {
        status.name: getattr(type(parameters), status.name) for status in ParameterStatus
    }


def test_messages_are_read_back_as_they_were(found):
    _, description, estimates = found
    said = messages(description, estimates)
    assert description_from(*said)._replace(masses=()) == description._replace(masses=())
    for again, estimate in zip(estimates_from(*([message] for message in said)), estimates, strict=True):
        assert_array_equal(again.parameters, estimate.parameters)
        assert_array_equal(again.extra, estimate.extra)
        assert_array_equal(again.extra_std, estimate.extra_std)


def test_json_and_table_have_it(found, tmp_path):
    recording, description, estimates = found
    errors = equation_errors(description, estimates)
    write_json(tmp_path / "found.json", as_json(recording, description, estimates, errors))
    content = json.loads((tmp_path / "found.json").read_text())
    assert tuple(content["besides"]) == tuple(content["series"]["besides"]) == description.extra
    table = besides_table(description, estimates[-1])
    for name, unit in zip(description.extra, description.extra_units):
        assert content["besides"][name]["unit"] == content["units"][name] == unit
        assert len(content["series"]["besides"][name]) == len(recording)
        assert name in table or np.isnan(estimates[-1].extra[description.extra.index(name)])
    if description.method == "gauss_newton":
        assert 0.0 < content["besides"]["block.ar1"]["std"] < 1.0
    if description.method == "afmm":
        weights = [content["series"]["besides"][f"model{k}.weight"][-1] for k in range(2)]
        assert sum(weights) == pytest.approx(1.0)
