"""The judge of the disturbed runs, on made-up outcomes: what must not pass does not."""

import pytest

from crash_estimator.chaos import results
from crash_estimator.chaos.case import EXAMPLE, Case, Fault, case_of
from crash_estimator.chaos.judge import COMPLETE, FAILED, SAID, Ended, Outcome, Product, judged
from crash_estimator.chaos.plan import plan
from crash_estimator.chaos.results import RESULTS, NoReference, kept, references, rows
from crash_replay.recording import RecordingError

REFERENCE = {"estimates": {"0": "a", "1": "b", "2": "c"}}
WHOLE = REFERENCE["estimates"]
CUT = {"0": "a", "1": "b"}
OTHER = {"0": "a", "1": "b", "2": "x"}
LOST = "incomplete: /kalman has 2 of 3 samples (was killed)"


def outcome(content=WHOLE, replay=(0, ""), kalman=(0, ""), killed=(), had_all=False, **more) -> Outcome:
    ended = [
        Ended("replay", *replay, killed="replay" in killed),
        Ended("kalman", *kalman, killed="kalman" in killed, had_all=had_all),
    ]
    return Outcome(ended, {"estimates": Product("kalman", content)}, **more)


@pytest.mark.parametrize(
    "verdict, left",
    [
        (COMPLETE, outcome()),
        (FAILED, outcome(OTHER)),  # other numbers, and nobody says a word
        (FAILED, outcome(CUT)),
        (FAILED, outcome({**WHOLE, "3": "d"})),
        (FAILED, outcome(CUT, replay=(0, LOST))),  # said, and the status is 0
        (FAILED, outcome(CUT, replay=(1, "incomplete: /rls has 2 of 3 samples"))),  # of somebody else
        (FAILED, outcome(CUT, replay=(1, ""))),
        (SAID, outcome(CUT, replay=(1, LOST))),
        (SAID, outcome(OTHER, kalman=(1, "incomplete: 2 of 3 samples (nobody can give them again)"))),
        (SAID, outcome(replay=(1, LOST))),  # all is there, though: the alarm was a false one, but given
        (FAILED, outcome(replay=(1, ""))),
        (SAID, outcome(CUT, replay=(1, LOST), kalman=(-9, ""), killed=["kalman"])),
        (FAILED, outcome(CUT, kalman=(-9, ""), killed=["kalman"])),  # the replay took no note of it
        (SAID, outcome(CUT, kalman=(-9, ""), killed=["kalman"], had_all=True)),  # the replay was through with it
        (FAILED, outcome(kalman=(-11, ""))),
        (FAILED, outcome(kalman=(None, ""))),
        (FAILED, outcome(endless="after 180 s still running: replay")),
        (FAILED, outcome(broken="recording.mcap does not open")),
        (FAILED, outcome(kalman=(0, "Traceback (most recent call last):"))),
        (SAID, outcome({}, replay=(-9, ""), killed=["replay"], sent=False)),  # before anything was sent
        (FAILED, outcome({}, replay=(-9, ""), killed=["replay"], sent=True)),
    ],
)
def test_verdict(verdict, left):
    assert judged(left, REFERENCE).verdict == verdict


@pytest.mark.parametrize("status, says, verdict", [(1, True, SAID), (1, False, FAILED), (0, True, FAILED)])
def test_a_file_may_say_it_itself(status, says, verdict):
    ended = [Ended("replay", 0, ""), Ended("record", status, "", killed=True)]
    left = Outcome(ended, {"recording": Product("record", CUT, says)})
    assert judged(left, {"recording": WHOLE}).verdict == verdict


def test_what_is_amiss_is_counted():
    assert judged(outcome(OTHER), REFERENCE).why == "nobody says it: estimates 1 of 3 other than undisturbed"


def test_a_case_is_made_again_from_its_name():
    for case in plan(seed=1, runs=300):
        assert case_of(case.name) == case


def test_a_plan_is_that_of_its_seed():
    assert plan(1, 50) == plan(1, 200)[:50]
    assert plan(1, 50) != plan(2, 50)


def test_the_plan_has_every_fault_on_every_member():
    befallen = {(fault.kind, fault.member) for case in plan(1, 200) for fault in case.faults}
    members = ("replay", "kalman", "record", "diagnosis", "worker", "demo", "estimator")
    assert {(kind, member) for kind in ("kill", "stop") for member in members} <= befallen
    assert {"restart", "hang_up", "full_disk", "one_core", "cold_caches"} <= {kind for kind, _ in befallen}


@pytest.mark.parametrize("name", ["terminals/side", "terminals/side/melt:replay@played3%", "terminals/side/stop"])
def test_what_is_no_case_is_said(name):
    with pytest.raises(RecordingError, match="written"):
        case_of(name)


def test_the_example():
    assert case_of(EXAMPLE) == Case(
        "terminals", "side",
        (Fault("stop", "replay", "played", 35.0, 7.5), Fault("kill", "kalman", "finished", 0.2)),
    )  # fmt: skip


def test_who_does_not_write_has_no_full_disk():
    full = {fault.member for case in plan(1, 500) for fault in case.faults if fault.kind == "full_disk"}
    assert full == {"record", "viewer", "demo"}


def test_a_judge_that_fails_costs_its_own_case_alone(tmp_path):
    """No such recording: what rises in its process is a row, and the next case is still done."""
    cases = [case_of(f"demo/{name}/undisturbed") for name in ("nowhere", "elsewhere")]
    (tmp_path / RESULTS).touch()
    found = {case.name: {} for case in cases}
    done = list(rows(cases, tmp_path / RESULTS, found, jobs=1, seed=1))
    assert [row["verdict"] for row in done] == [FAILED, FAILED] and kept(tmp_path / RESULTS) == done
    assert all(row["why"].startswith("the judge failed: KeyError(") for row in done)


@pytest.mark.parametrize("verdict", [COMPLETE, SAID])
def test_only_what_is_complete_undisturbed_is_compared_with(monkeypatch, tmp_path, verdict):
    case = case_of("estimators/frontal/kill:rls@played50%")

    def done(cases, out, found, jobs):
        assert [(one.name, found[one.name]) for one in cases] == [(case.undisturbed.name, None)]
        yield {"case": case.undisturbed.name, "verdict": verdict, "why": "lost", "contents": REFERENCE}

    monkeypatch.setattr(results, "_in_processes", done)
    monkeypatch.setattr(results, "bag_of", lambda recording, bags: None)
    if verdict == COMPLETE:
        assert references([case, case], tmp_path) == {case.undisturbed.name: REFERENCE}
    else:
        with pytest.raises(NoReference, match=f"{case.undisturbed.name}: {verdict}: lost"):
            references([case], tmp_path)
