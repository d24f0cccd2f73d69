"""Two effects in the place of those that were found one after the other."""

from types import SimpleNamespace

import pytest
from helpers_made_up_fits import candidate

from crash_estimator.benchmarks.effects_judge import drawn
from crash_estimator.benchmarks.effects_plan import case_of
from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.diagnosis.selection import sequential_replacement
from crash_estimator.core.diagnosis.selection.selection_step import SelectionStep
from crash_estimator.core.diagnosis.selection.thresholds import THRESHOLDS

MAGNITUDES = SimpleNamespace(structure=None)
FRICTION, DAMPING, GAS, RATE = (SimpleNamespace(key=(name, "mount")) for name in ("friction", "damping", "gas", "rate"))


@pytest.mark.parametrize(
    ("name", "pair"),
    [
        (
            "frontal/gas_cushion+viscous_damping/1/1g/10000Hz/0.75,1.1/20000486",
            [("viscous_damping", "cab_barrier"), ("gas_cushion", "engine_barrier")],
        ),
        (
            "single/force_offset+guide_friction/1/1g/10000Hz/0.75,1.1/18000347",
            [("guide_friction", "car"), ("force_offset", "barrier_fx")],
        ),
    ],
)
def test_two_effects_are_found_though_another_one_comes_first_while_the_second_is_missing(name, pair):
    """While the gas at the engine is missing, a Maxwell element at the cab leaves less than its damper does; while the
    force is off, no effect leaves noise, and both are rare."""
    _, structure, recordings = drawn(case_of(name))
    found = diagnose(structure, recordings)
    assert found.verdict == "effect_missing" and found.complete
    assert [(step.effect, step.target) for step in found.steps] == pair


def model(mean_square: float, *found, evidence: float = 0.0, inflated: bool = False):
    fit = SimpleNamespace(evidence=evidence, problem=SimpleNamespace(noise_is_inflated=inflated))
    residuals, white = SimpleNamespace(mean_square=mean_square), mean_square < 1.01
    return SimpleNamespace(
        fit=fit, residuals=residuals, white=white, found=found, additions=found, given=(), records=()
    )


def sought(monkeypatch, beside: dict, final, path, fitted=lambda m, records, additions: model(9.0, *additions)):
    """What others were sought beside, and the pair that takes the place of the final model's two; beside: what is best
    beside an addition, and the model with both."""
    monkeypatch.setattr(sequential_replacement, "search_is_over", lambda: False)
    monkeypatch.setattr(sequential_replacement, "as_found", lambda one: one.addition)
    monkeypatch.setattr(sequential_replacement, "analyse", lambda fit: SimpleNamespace(mean_square=1.5))
    monkeypatch.setattr(sequential_replacement, "fit_model", fitted)
    monkeypatch.setattr(sequential_replacement, "as_fitted", lambda given, one: model(9.0, one.addition))
    asked = []

    def best(magnitudes, effects, given, first):
        asked.append(first.addition)
        return model(9.0, first.addition), [candidate(500.0)._replace(addition=beside[first.addition.key][0])]

    monkeypatch.setattr(sequential_replacement, "seconds_beside", best)
    monkeypatch.setattr(sequential_replacement, "added", lambda m, larger, one: beside[larger.found[0].key][1])
    return asked, sequential_replacement.replaced(MAGNITUDES, {}, model(50.0), path, final)


@pytest.fixture
def path():
    """Friction was found first, and a rate effect is the best beside it."""
    first = SelectionStep(model(50.0), [candidate(900.0)], [candidate(900.0)])
    second = candidate(500.0)._replace(addition=RATE)
    return [first, SelectionStep(model(3.0, FRICTION), [second], [second])]


def test_each_is_sought_anew_beside_the_other_until_two_leave_noise(monkeypatch, path):
    both = model(1.0, DAMPING, GAS)
    beside = {RATE.key: (DAMPING, model(1.4, RATE, DAMPING)), DAMPING.key: (GAS, both)}
    asked, pair = sought(monkeypatch, beside, model(1.5, FRICTION, RATE), path)
    assert asked == [RATE, DAMPING] and pair.model is both


@pytest.mark.parametrize("larger", [DAMPING, GAS])
def test_of_two_that_take_the_place_what_explains_more_alone_comes_first(monkeypatch, path, larger):
    beside = {RATE.key: (DAMPING, model(1.4, RATE, DAMPING)), DAMPING.key: (GAS, model(1.0, DAMPING, GAS))}

    def fitted(magnitudes, records, additions):
        return model(
            1.0 if len(additions) == 2 else 9.0, *additions, evidence=800.0 if additions[0] is larger else 700.0
        )

    _, pair = sought(monkeypatch, beside, model(1.5, FRICTION, RATE), path, fitted)
    leaders = [step.candidates[0].addition for step in pair.path]
    assert leaders == list(pair.model.found) and leaders[0] is larger


def test_where_the_same_is_best_again_there_are_no_others(monkeypatch, path):
    beside = {RATE.key: (FRICTION, model(1.4, RATE, FRICTION))}
    assert sought(monkeypatch, beside, model(1.5, FRICTION, RATE), path) == ([RATE], None)


@pytest.mark.parametrize(("ahead", "taken"), [(THRESHOLDS.gain + 1.0, True), (THRESHOLDS.gain - 1.0, False)])
def test_of_two_pairs_that_leave_noise_the_other_must_be_likelier_by_as_much_as_counts(monkeypatch, path, ahead, taken):
    final, other = model(1.0, FRICTION, RATE, evidence=100.0), model(1.0, RATE, DAMPING, evidence=100.0 + ahead)
    beside = {RATE.key: (DAMPING, other), DAMPING.key: (RATE, other)}
    _, pair = sought(monkeypatch, beside, final, path)
    assert (pair and pair.model) is (other if taken else None)


@pytest.mark.parametrize(("left", "taken"), [(1.5, True), (2.5, False)])
def test_two_that_leave_next_to_nothing_of_what_was_left_are_taken_too(monkeypatch, path, left, taken):
    other = model(left, RATE, DAMPING)
    beside = {RATE.key: (DAMPING, other), DAMPING.key: (RATE, other)}
    _, pair = sought(monkeypatch, beside, model(90.0, FRICTION, RATE), path)
    assert (pair and pair.model) is (other if taken else None)


def test_nothing_is_sought_where_one_effect_leaves_noise(monkeypatch, path):
    assert sought(monkeypatch, {}, model(1.0, FRICTION), path) == ([], None)
