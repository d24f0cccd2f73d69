"""What the demonstration tells of the search for what is missing."""

import pytest
from helpers_findings import ADDED, candidate, misfit, ranking

from crash_estimator.demo.story import Story
from crash_estimator.viewer.findings import MisfitBlock


def tell(story: Story, *blocks) -> list[str]:
    return [line for b in blocks for line in (story.misfit(b) if isinstance(b, MisfitBlock) else story.ranking(b))]


def test_the_whole_story():
    story = Story()
    signs = tell(story, *(ranking(0.002 * k, 20.0) for k in range(8)))
    assert signs == [f"  4.0 ms: {ADDED} would explain 50% of the misfit so far"], "once it has led three times"
    assert not story.complete
    answer = tell(story, ranking(0.09, 300.0, final=True), misfit(0.06))
    assert answer == [
        "all samples: effect missing; error 4.08 g, noise floor 1.02",
        "where it fails: engine, loading, 10.0 to 30.0 ms: RMS 3.06 g; engine, unloading, 30.0 to 60.0 ms: RMS 5.1 g",
        f"what it lacks: {ADDED}, 1800 ± 200 N; evidence 300 nats, explains 50%",
    ]
    assert not story.complete, "the model with it has not been judged"
    end = tell(story, ranking(0.09, 2.0, final=True, revision=1), misfit(0.06))
    assert end == [
        "the error falls: 4.08 -> 1.07 g (simulated freely 4.49 -> 1.12 g), noise floor 1.02; what is left is white",
        "verdict with it: adequate",
    ]
    assert story.complete and len(signs + answer + end) <= 10


def test_adequate_ends_the_story_at_once():
    story = Story()
    assert tell(story, ranking(0.09, 2.0, final=True)) == ["all samples: adequate; error 4.08 g, noise floor 1.02"]
    assert story.complete


def test_where_nothing_explains_enough_the_best_is_told_as_such_and_nothing_is_waited_for():
    story, block = Story(), ranking(0.09, 300.0, final=True)._replace(verdict="unexplained")
    told = tell(story, block, misfit(0.06))
    assert told[0].startswith("all samples: unexplained") and "does not explain it" in told[-1]
    assert story.complete, "the diagnosis adds nothing then"


def test_what_cannot_be_told_apart_is_said():
    rivals = ("a on b", "c on d", "e on f", "g on h")
    block = ranking(0.09, 300.0, final=True)._replace(ranking=(candidate(ADDED, 300.0, rivals),))
    assert tell(Story(), block, misfit(0.06))[-1] == "not told from it here: a on b, c on d, e on f and 1 more"


def test_the_share_of_a_measured_force_is_told():
    share = dict(force="barrier_fx", force_explained_before=0.102, force_explained_after=0.81)
    told = tell(Story(), ranking(0.09, 300.0, final=True, **share), misfit(0.06))
    assert told[-1] == "share of barrier_fx that the inertias explain: 10% -> 81%"


OTHER = ranking(0.01, 20.0)._replace(ranking=(candidate("x on y", 20.0),))


@pytest.mark.parametrize("unsure", [ranking(0.01, 2.0), OTHER])
def test_a_candidate_that_does_not_stay_ahead_is_no_sign(unsure):
    assert tell(Story(), *[ranking(0.01, 20.0), ranking(0.012, 20.0), unsure] * 3) == []
