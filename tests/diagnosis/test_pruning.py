"""What was found first may have stood for what was found later: the fits are made up."""

from types import SimpleNamespace

import pytest

from crash_estimator.core.diagnosis import THRESHOLDS
from crash_estimator.core.diagnosis.selection import pruning
from crash_estimator.core.diagnosis.selection.candidate_fits import CandidateFit
from crash_estimator.core.diagnosis.selection.selection_step import SelectionStep


def model(additions, white=True):
    evidence = 1000.0 if white else 0.0
    found = tuple(additions)
    return SimpleNamespace(additions=found, given=(), found=found, white=white, fit=SimpleNamespace(evidence=evidence))


@pytest.mark.parametrize("at_its_limit", [False, True])  # there the search ends with the last that was added
@pytest.mark.parametrize(
    ("spared", "left"),
    [
        ({"mimic"}, ["damper", "friction"]),
        ({"damper"}, ["mimic", "friction"]),
        (set(), ["mimic", "damper", "friction"]),
        ({"mimic", "damper"}, ["friction"]),
    ],
)
def test_an_effect_that_the_rest_leaves_noise_without_goes_again(monkeypatch, spared, left, at_its_limit):
    """The last one found stays: without it there was no noise."""
    names = ["mimic", "damper", "friction"]
    monkeypatch.setattr(
        pruning,
        "_refitted",
        lambda magnitudes, additions, like: model(additions, white={*names} - {*additions} <= spared),
    )
    path = [SelectionStep(model(names[:k], k == 3), [CandidateFit(name, 50.0, "fit")]) for k, name in enumerate(names)]
    last = SelectionStep(model(names), [CandidateFit("none", 0.5 * THRESHOLDS.gain, "fit")])
    found, final = pruning.without_the_superseded(None, path if at_its_limit else [*path, last], model(names))
    assert list(final.additions) == left
    assert [step.candidates[0].addition for step in found] == [*left, *([] if at_its_limit else ["none"])]
    assert [list(step.before.additions) for step in found] == [left[:k] for k in range(len(found))]


@pytest.mark.parametrize(("ended", "left"), [(0.0, ["damper"]), (9.0, ["mimic", "damper"])])
def test_what_has_ended_at_nothing_goes_where_more_than_noise_is_left_too(monkeypatch, ended, left):
    """A damper on another element, found first, was told as 0 N s/m beside the right one."""
    mimic, damper = SimpleNamespace(touches=()), SimpleNamespace(touches=())
    names = {id(mimic): "mimic", id(damper): "damper"}
    terms = {id(mimic): SimpleNamespace(coefficient=0), id(damper): SimpleNamespace(coefficient=1)}
    layout = SimpleNamespace(term=lambda addition: terms[id(addition)])
    fit = SimpleNamespace(evidence=1000.0, layout=layout, theta=[ended, 500.0])
    final = SimpleNamespace(additions=(mimic, damper), given=(), found=(mimic, damper), white=False, fit=fit)
    smaller = SimpleNamespace(additions=(damper,), found=(damper,), white=False, fit=SimpleNamespace(evidence=1000.0))
    monkeypatch.setattr(pruning, "_refitted", lambda magnitudes, additions, like: smaller)
    path = [SelectionStep(None, [CandidateFit(one, 50.0, "fit")]) for one in (mimic, damper)]
    path.append(SelectionStep(final, [CandidateFit("none", 0.0, "fit")]))
    _, model_left = pruning.without_the_superseded(None, path, final)
    assert [names[id(one)] for one in model_left.additions] == left


@pytest.mark.parametrize(("without", "left"), [(1001.0, ["friction"]), (999.0, ["mimic", "friction"])])
def test_an_effect_that_gains_nothing_beside_the_rest_goes_whatever_is_left_without_it(monkeypatch, without, left):
    """Where it explains but the last of what is no noise, it need not gain as much as where noise is left anyway."""
    names = ["mimic", "friction"]
    smaller = model(["friction"], white=False)
    smaller.fit.evidence = without
    monkeypatch.setattr(pruning, "_refitted", lambda magnitudes, additions, like: smaller)
    path = [SelectionStep(model(names[:k], False), [CandidateFit(name, 50.0, "fit")]) for k, name in enumerate(names)]
    path.append(SelectionStep(model(names), [CandidateFit("none", 0.0, "fit")]))
    assert list(pruning.without_the_superseded(None, path, model(names))[1].additions) == left
