"""One description of an estimate's row: everything that names its parts is derived from `core.estimate.ROW`.

A number is added to it here, and to nothing else: rows, columns, messages and blocks have to follow.
"""

from dataclasses import fields

import numpy as np
import pytest
from crash_msgs.msg import Equation, Forces, Parameter, ParametersBlock, ResidualsBlock

from crash_estimator.core.compiled import layout
from crash_estimator.core.compiled.views import row_views
from crash_estimator.core.estimate import DIAGONALS, ROW, Description, Estimate, as_sent, nothing_said, sent
from crash_estimator.following.columns import SENT, columns_of
from crash_estimator.nodes.estimate_messages import FIELDS, NAMES, EstimateMessages
from crash_estimator.viewer.blocks import ForceBlock, ParameterBlock, ResidualBlock, said_of

OF = {
    "parameters": ("parameters",),
    "equations": ("equations",),
    "elements": ("elements", "bodies"),
}
DESCRIPTION = Description(
    "model", "method", ("k", "c"), ("N/m", "N*s/m"), ("body",), ("m/s^2",), ("spring",), (("body", "wall"),),
    ("body", "wall"), (1.0, 2.0), ("ar1",), ("",),
)  # fmt: skip


def fields_of(message) -> set[str]:
    return set(message.get_fields_and_field_types())


def test_a_row_of_the_compiled_recursion_begins_with_it():
    assert {name: axes for name, axes in layout.ROW.items() if name in ROW} == {
        name: (quantity.of,) for name, quantity in ROW.items()
    }
    assert list(layout.ROW)[: len(ROW)] == list(ROW)
    size = layout.Size(3, 3, 2, 1, 2, 2, 0, 2, 1, 0)
    assert row_views(np.zeros(layout.length(layout.ROW, size)), size)._fields == tuple(layout.ROW)


def test_an_estimate_has_all_of_it():
    known = {one.name for one in fields(Estimate)}
    assert set(ROW) - set(DIAGONALS) <= known and set(DIAGONALS.values()) <= known
    assert all(isinstance(getattr(Estimate, name), property) for name in DIAGONALS)


@pytest.mark.parametrize(
    ("message", "of"), [(ParametersBlock, "parameters"), (ResidualsBlock, "equations"), (Forces, "elements")]
)
def test_the_messages_carry_it_and_nothing_else_of_a_sample(message, of):
    head = {"header", "run", "number", "time_ns", "model", "method", "revision", "unit", "between", "mass"}
    assert FIELDS[message] == sent(*OF[of])
    assert fields_of(message) - head - set(NAMES.values()) == set(FIELDS[message])


@pytest.mark.parametrize(("entry", "of"), [(Parameter, "parameters"), (Equation, "equations")])
def test_the_messages_by_name_carry_the_same(entry, of):
    assert fields_of(entry) - {"name", "unit"} == set(sent(of))


@pytest.mark.parametrize(
    ("block", "of"), [(ParameterBlock, "parameters"), (ResidualBlock, "equations"), (ForceBlock, "elements")]
)
def test_the_viewer_draws_of_it_what_its_blocks_have(block, of):
    assert set(said_of(block)) == set(block._fields) & set(sent(*OF[of]))


def test_columns_and_messages_of_an_estimate_hold_all_of_it_and_give_it_back():
    rng = np.random.default_rng(1)
    nothing = nothing_said(DESCRIPTION, 7, 3_000)
    told = {
        name: rng.integers(0, 3, len(getattr(DESCRIPTION, of))).astype(np.uint8)
        if code
        else rng.random(len(getattr(DESCRIPTION, of)))
        for name, (of, _, code) in ROW.items()
        if name not in DIAGONALS
    }
    estimate = nothing._replace(
        **told, covariance=np.diag([1.0, 4.0]), innovation_covariance=np.diag([9.0]), extra=(0.5,), extra_std=(0.1,)
    )
    columns = columns_of([estimate])
    assert set(columns.of) == set(SENT)
    again = as_sent(nothing, 7, 3_000, {field: columns.of[field][0] for field in SENT}, elsewhere=0.0)
    for one in fields(Estimate):
        np.testing.assert_array_equal(getattr(again, one.name), getattr(estimate, one.name), err_msg=one.name)
    messages = EstimateMessages(DESCRIPTION)
    assert all(make(0, 0, columns) for make in (messages.parameters, messages.residuals, messages.forces))
