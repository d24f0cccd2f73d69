"""Why what is found is not named, in words."""

import pytest
from helpers_verdict import EVIDENCE, HARDLY_MORE, LEADER, VARIES, left, ranked

from crash_estimator.core.diagnosis.report.verdict import CURVE, doubt_of


@pytest.mark.parametrize(
    "changed, within, said",
    [
        ({}, False, ""),
        ({"added": 3}, False, "more than 2 effects are likelier one of another kind"),
        ({"certain": False}, False, "a coefficient is within its standard deviation, or as large as it can be"),
        ({"after": left(0.19, 6.0)}, False, "more than 75% is asked for"),
        ({"needed": 0.97}, False, "more than 97% is asked for"),
        ({"needed": 1.0, "after": left(0.0, 0.1)}, False, CURVE),
        ({"weighed": False}, False, "the evidence was not weighed against what is left"),
        ({"drift": VARIES}, False, "most of what is left varies with time"),
        ({"ranking": (LEADER, ranked("clearance", "engine", 45.0))}, False, "clearance on engine may do so as well"),
        ({"ranking": HARDLY_MORE}, False, "clearance on engine may do so as well"),
        ({"ranking": HARDLY_MORE}, True, ""),
    ],
)
def test_what_is_found_and_not_named_is_said_why(changed, within, said):
    assert doubt_of(EVIDENCE._replace(**changed), within) == said
