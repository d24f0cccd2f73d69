"""Which contacts are assumed otherwise: the fits are made up, what is tried after them is judged."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from helpers_made_up_fits import model

from crash_estimator.core.diagnosis import THRESHOLDS
from crash_estimator.core.diagnosis.selection import assumptions, contact_promise
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.effect import Addition


def test_what_other_contacts_promise_of_a_path_is_worked_out_once(monkeypatch):
    asked = []
    with_contacts(monkeypatch, {"b": 3.0}, ends_early=True)
    monkeypatch.setattr(assumptions, "promised_by", lambda other, *given: asked.append(other) or 3.0 * (other == "b"))
    assumptions._selected("stated", (), {})
    assert asked[:3] == ["a", "b", "c"] and asked.count("b") == 1


@pytest.mark.parametrize(("promised", "tried"), [({}, []), ({"b": 3.0}, ["b"]), ({"a": 2.0, "c": 3.0}, ["c", "a"])])
def test_contacts_are_assumed_otherwise_as_long_as_that_promises_anything(monkeypatch, promised, tried):
    searched = with_contacts(monkeypatch, promised)
    assert assumptions._selected("stated", (), {}).final.white is False
    assert searched == ["stated", *tried]


@pytest.mark.parametrize("noise_under", ["b", "none"])
def test_where_other_contacts_promise_more_than_a_first_step_only_they_are_searched_to_the_end(
    monkeypatch, noise_under
):
    searched = with_contacts(monkeypatch, {"b": 3.0}, noise_under, ends_early=True)
    found = assumptions._selected("stated", (), {})
    assert searched == ["stated", "b"]
    assert found.whole and found.final.white == (noise_under == "b")


def with_contacts(monkeypatch, promised, noise_under="none", ends_early=False) -> list[str]:
    """Contacts a, b and c that promise something (nats) and leave noise or not -> where all is looked for, in turn."""
    searched = []

    def search(structure, records, effects, elsewhere=lambda path: False):
        searched.append(structure)
        final = model(white=structure == noise_under)
        path = assumptions.SelectionPath(structure, [SimpleNamespace(best=None)], final, final.fit, (), 36)
        begun = path._replace(whole=False)
        return begun if ends_early and elsewhere(begun) else path

    for name, short in (("never_pulling", "a"), ("elastic_when_spent", "b"), ("all_when_spent", "c")):
        monkeypatch.setattr(assumptions, name, lambda structure, short=short: short)
    monkeypatch.setattr(assumptions, "promised_by", lambda other, *given: promised.get(other, -np.inf))
    monkeypatch.setattr(assumptions, "search_is_over", lambda: False)
    monkeypatch.setattr(assumptions, "_as_exact_as_needed", search)
    monkeypatch.setattr(assumptions, "likely_first", lambda path: iter(()))
    monkeypatch.setattr(assumptions, "_rings", lambda begun: False)
    return searched


@pytest.mark.parametrize(("gain", "cost", "best_first", "promises"), [
    (0.9, 1000.0, -np.inf, False),  # less than any candidate must gain
    (1.1, 1000.0, -np.inf, True),
    (1.1, 200_000.0, -np.inf, False),  # nothing beside what is left above the noise of a thousand samples
    (1.1, 1000.0, 2.0 * THRESHOLDS.gain, False),  # less than another effect explains under the contacts as they are
])  # fmt: skip
def test_other_contacts_must_explain_a_share_of_what_is_above_the_noise(monkeypatch, gain, cost, best_first, promises):
    one = SimpleNamespace(key=("one", "element"), variant="")
    final = model(cost=cost, additions=(one,))
    record = SimpleNamespace(bins=500, measured=np.zeros((1, 2)))
    best = SimpleNamespace(fit=SimpleNamespace(evidence=best_first))
    path = SimpleNamespace(
        structure="as stated", added=(one,), final=final, cells=36, as_recorded=final.fit, whole=True,
        steps=[SimpleNamespace(before=final, as_recorded=[best])], least_cost=final.fit.cost, records=[record],
    )  # fmt: skip
    with_fits(monkeypatch, gain * THRESHOLDS.gain)
    monkeypatch.setattr(contact_promise, "moves_otherwise", lambda *given: True)
    assert np.isfinite(contact_promise.promised_by("other", path, ())) == promises


@pytest.mark.parametrize(("gains", "promises"), [(0.4, False), (0.6, True), (1.1, True)])
def test_candidates_that_contacts_concern_are_asked_behind_those_that_they_do_not(monkeypatch, gains, promises):
    """A speed, a mass and a force explained more of a Maxwell element than the damper whose contact was wrong. What
    stays behind the best must gain half of what it lacked: of 1000 nats here, by which the best is ahead."""
    given = model(additions=())
    evidence = {"speed": 0.0, "mass": -10.0, "force": -20.0, "damper": -1000.0}
    fits = {key: SimpleNamespace(evidence=e, cost=3000.0, name=key) for key, e in evidence.items()}
    first = [SimpleNamespace(fit=fitted) for fitted in fits.values()]
    record = SimpleNamespace(bins=500, measured=np.zeros((1, 2)))
    path = SimpleNamespace(
        structure="as stated", added=(), final=given, cells=36, as_recorded=given.fit, whole=False,
        steps=[SimpleNamespace(before=given, as_recorded=first)], least_cost=3000.0, records=[record],
    )  # fmt: skip
    likely = [([SimpleNamespace(key=(key, "car"), variant="")], fitted) for key, fitted in fits.items()]
    with_fits(monkeypatch, -1000.0 + 1000.0 * gains)
    monkeypatch.setattr(contact_promise, "moves_otherwise", lambda one, other: getattr(one, "name", "") == "damper")
    assert np.isfinite(contact_promise.promised_by("other", path, likely)) == promises


def test_rare_candidates_that_leave_less_than_all_others_are_asked_first(monkeypatch):
    """A damper that grows with the crush left less than half of what the best common candidate did under a contact that
    may pull, and under the right one noise: without it two effects were told, neither of which is there."""
    first = SimpleNamespace(
        before=SimpleNamespace(additions=()),
        doubted=[SimpleNamespace(addition="rare", fit="leaves less", gain=2e3)],
        as_recorded=[SimpleNamespace(addition=name, fit=name, gain=1e3) for name in ("common", None)],
    )  # fmt: skip
    path = SimpleNamespace(
        structure=None,
        records=(),
        cells=36,
        steps=[first],
        final=model(white=False),
        least_cost=0.0,
    )
    monkeypatch.setattr(contact_promise, "measure_magnitudes", lambda *given: None)
    monkeypatch.setattr(contact_promise, "_in_other_forms", lambda addition: ())
    assert [*contact_promise.likely_first(path)] == [(("rare",), "leaves less"), (("common",), "common")]


def with_fits(monkeypatch, evidence):
    """All models are fitted with as much evidence under other contacts."""
    otherwise = SimpleNamespace(evidence=evidence)
    monkeypatch.setattr(contact_promise, "measure_magnitudes", lambda *given: None)
    monkeypatch.setattr(contact_promise, "in_the_sensors_noise", lambda model, records: model.fit)
    monkeypatch.setattr(contact_promise, "_fitted_slowly", lambda *given: otherwise)


def test_a_stop_is_asked_of_in_both_its_forms():
    """One inside the curve leaves least under contacts in which the one beside it stops short."""
    stop = Addition(EFFECTS["bottoming_out"], "front", shapes={"stop": 0.4}, variant="in_curve")
    (other,) = contact_promise._in_other_forms(stop)
    assert other == replace(stop, variant="")
    uneven = Addition(EFFECTS["viscous_damping"], "front", shapes={"rebound": 0.4}, variant="uneven")
    assert not [*contact_promise._in_other_forms(uneven)], "its constant is none of the other forms'"
