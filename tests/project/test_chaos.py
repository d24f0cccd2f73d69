"""Some of the cheapest disturbed runs, so that what `make chaos` counts is known to be carried out and judged."""

import pytest
from helpers_domain import own_domain

from crash_estimator.chaos import run as chaos_run
from crash_estimator.chaos.case import case_of
from crash_estimator.chaos.judge import COMPLETE, SAID, judged
from crash_estimator.chaos.run import run_case

STOPPED = "estimators/frontal/stop:kalman@played30%:7s"
KILLED = "estimators/frontal/kill:rls@played50%"
HUNG_UP = "estimators/frontal/hang_up:kalman@played40%"
WITHOUT_REPLAY = "estimators/frontal/kill:replay@played60%"
WITHOUT_RECORD = "estimators/frontal/kill:record@played50%"
FULL_DISK = "estimators/frontal/full_disk:record@played30%"


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    return tmp_path_factory.mktemp("chaos")


@pytest.fixture(scope="module", autouse=True)
def domains():
    """Those of this test process: another one's nodes may not have come into theirs yet when a run draws its own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chaos_run, "free_domain", own_domain)
        yield


@pytest.fixture(scope="module")
def reference(out, domains):
    row = run_case(case_of(STOPPED).undisturbed, out, None)
    assert row["verdict"] == COMPLETE, row
    return row["contents"]


@pytest.mark.parametrize(
    "name, verdict, statuses",
    [
        (KILLED, SAID, {"kalman": 0, "rls": -9, "record": 1, "replay": 1}),
        (HUNG_UP, SAID, {"kalman": 1, "rls": 0, "record": 1, "replay": 1}),
        (WITHOUT_REPLAY, SAID, {"kalman": 1, "rls": 1, "record": 1, "replay": -9}),
        (WITHOUT_RECORD, SAID, {"kalman": 0, "rls": 0, "record": -9, "replay": 1}),
        (FULL_DISK, SAID, {"kalman": 0, "rls": 0, "record": 1, "replay": 1}),
    ],
)
def test_run(name, verdict, statuses, out, reference):
    row = run_case(case_of(name), out, reference)
    assert (row["verdict"], row["statuses"]) == (verdict, statuses), row
    assert row["carried out"] and not row["not carried out"]


def test_who_was_stopped_is_complete_and_a_wrong_reference_is_noticed(out, reference, monkeypatch):
    """A run that is whole and says so fails where its numbers are not those of the reference."""
    outcomes = []
    monkeypatch.setattr(chaos_run, "judged", lambda outcome, by: outcomes.append(outcome) or judged(outcome, by))
    other = {name: content | {"5": "another"} for name, content in reference.items()}
    row = run_case(case_of(STOPPED), out, other)
    assert row["verdict"] == "FAILED" and "1 of 341 other than undisturbed" in row["why"]
    assert row["statuses"] == {"kalman": 0, "rls": 0, "record": 0, "replay": 0}, row
    assert row["carried out"] and not row["not carried out"]
    assert judged(outcomes[-1], reference).verdict == COMPLETE
