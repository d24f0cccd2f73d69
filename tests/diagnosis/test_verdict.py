"""The verdict in two grades: named or not, complete or not; and what is left, in the band that a model speaks for."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from helpers_paths import ROOT
from helpers_verdict import (
    EVIDENCE,
    GAINS_LITTLE,
    HALF_AS_MUCH_AGAIN,
    HARDLY_MORE,
    LEADER,
    LESS_LIKELY,
    NOTHING_VARIES,
    STANDS_STILL,
    VARIES,
    left,
    ranked,
)

from crash_estimator.cli import diagnose as command
from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.diagnosis.report import diagnosis as report
from crash_estimator.core.diagnosis.report import verdict_text
from crash_estimator.core.diagnosis.report.tolerance import DEFAULT, Tolerance, tolerance_of
from crash_estimator.core.diagnosis.report.verdict import verdict_on
from crash_estimator.core.diagnosis.residuals.in_band import InBand
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.effect import Addition
from crash_estimator.core.structure import Coefficient, ModelError
from crash_estimator.model_file import load_model
from crash_replay.bag import read_bag
from crash_replay.conditioning import filter_recording
from crash_replay.recording import Recording
from crash_replay.synthetic.hidden.cases import draw_case

FRONTAL = ROOT / "bags" / "frontal_single.mcap"
MENDED = {"after": left(0.04, 0.5)}
"""Where the model before leaves little."""
LITTLE, DROWNED = left(0.009, 1.0), left(0.009, 0.13)
"""Within the tolerance; and less than the noise as well, which is 0.1."""


@pytest.mark.parametrize(
    "changed, tolerance, word, complete",
    [
        ({}, DEFAULT, "effect_missing", False),
        ({"after": left(0.009, 2.0)}, DEFAULT, "effect_missing", True),
        ({"white": True, "drift": NOTHING_VARIES}, DEFAULT, "effect_missing", True),
        ({"white": True, "drift": NOTHING_VARIES, "loud": True}, DEFAULT, "effect_missing", False),
        ({"white": True, "drift": NOTHING_VARIES, "loud": True, "after": LITTLE}, DEFAULT, "effect_missing", True),
        ({"after": left(0.19, 9.0)}, DEFAULT, "unexplained", False),  # it explains a fifth
        ({"needed": 0.97}, DEFAULT, "unexplained", False),  # it explains 0.96, by a law that bends far
        ({"drift": VARIES, "by_first": 0.9}, DEFAULT, "unexplained", False),
        ({"drift": VARIES, "by_first": 0.96}, DEFAULT, "effect_missing", False),
        ({"white": True}, DEFAULT, "unexplained", False),  # it looks like noise, and varies with time
        ({"varying": "a force on car"}, DEFAULT, "unexplained", False),
        ({"varying": "a force on car", "white": True, "drift": NOTHING_VARIES}, DEFAULT, "unexplained", True),
        ({"weighed": False}, DEFAULT, "unexplained", False),
        ({"certain": False}, DEFAULT, "unexplained", False),
        ({"added": 2}, DEFAULT, "effect_missing", False),
        ({"added": 3}, DEFAULT, "unexplained", False),
        ({"ranking": (LEADER, ranked("clearance", "engine", 45.0))}, DEFAULT, "unexplained", False),
        ({"ranking": (LEADER, ranked("clearance", "engine", 45.0, fitted=False))}, DEFAULT, "effect_missing", False),
        ({"ranking": (LEADER, ranked("viscous_damping", "car_barrier", 49.0))}, DEFAULT, "effect_missing", False),
        ({"ranking": HARDLY_MORE}, DEFAULT, "unexplained", False),  # is left by another one elsewhere
        ({"ranking": HALF_AS_MUCH_AGAIN}, DEFAULT, "effect_missing", False),
        ({"ranking": LESS_LIKELY}, DEFAULT, "effect_missing", False),
        ({"ranking": HARDLY_MORE, "white": True, "by_first": 0.96}, DEFAULT, "effect_missing", False),
        ({"white": True, "by_first": 0.96}, DEFAULT, "effect_missing", False),  # of little weight beside that
        ({"after": left(0.05, 6.0)}, DEFAULT, "unexplained", False),  # it explains two thirds
        ({"drift": VARIES, "after": left(0.009, 0.9)}, DEFAULT, "effect_missing", True),  # it explains 0.992
        ({"drift": VARIES, "after": left(0.009, 1.5)}, DEFAULT, "unexplained", False),  # it explains 0.978
        ({"drift": VARIES, "after": left(0.02, 0.9)}, DEFAULT, "unexplained", False),  # of more than the tolerance
        ({"drift": VARIES, "after": left(0.02, 0.13)}, DEFAULT, "effect_missing", False),  # but less than the noise
        ({"drift": VARIES, "after": left(0.009, 0.9), "added": 2}, DEFAULT, "unexplained", False),
        ({"added": 0, "before": LITTLE, "after": LITTLE}, DEFAULT, "adequate", True),
        ({"before": LITTLE, "after": LITTLE}, DEFAULT, "unexplained", False),  # something was added, to no avail
        ({"before": DROWNED, "after": DROWNED, "ranking": GAINS_LITTLE}, DEFAULT, "adequate", True),
        ({"before": DROWNED, "after": DROWNED}, DEFAULT, "unexplained", False),  # though a candidate gains 50 nats
        ({"before": LITTLE, "after": LITTLE, "added": 0, "white": True}, DEFAULT, "unexplained", False),  # and varies
        ({"added": 0, "after": left(0.05, 1.0)}, DEFAULT, "unexplained", False),
        ({"before": left(0.04, 1.0), **MENDED}, DEFAULT, "effect_missing", False),
        ({"before": left(0.04, 1.0), **MENDED}, Tolerance(of_peak=0.05), "adequate", True),
        ({}, Tolerance(of_peak=0.05), "effect_missing", True),
        ({"after": left(0.05, 2.0, rating=0.7)}, Tolerance(rating=0.8), "effect_missing", False),
        ({"before": left(0.05, 2.0, rating=0.85), **MENDED}, Tolerance(rating=0.8), "adequate", True),
        ({"before": left(0.05, 2.0, rating=None), **MENDED}, Tolerance(rating=0.8), "effect_missing", True),
    ],
)  # fmt: skip
def test_what_is_said_of_which_evidence(changed, tolerance, word, complete):
    assert verdict_on(EVIDENCE._replace(**changed), tolerance) == (word, complete)


@pytest.mark.parametrize(("inflated", "rms", "weighed"), [
    (True, 6.0, True), (True, 0.11, True), (False, 0.11, True), (False, 6.0, False),
])  # fmt: skip
def test_evidence_is_weighed_in_noise_as_large_as_what_is_left_or_where_next_to_nothing_is_left(
    monkeypatch, inflated, rms, weighed
):
    """Of 10 m/s^2 as given; the sensors' noise is 0.1."""
    given = SimpleNamespace(fit=None)
    fit = SimpleNamespace(problem=SimpleNamespace(noise_is_inflated=inflated))
    friction = Addition(EFFECTS["coulomb_friction"], "car_barrier")
    final = SimpleNamespace(fit=fit, white=False, additions=(friction,))
    path = SimpleNamespace(
        steps=[SimpleNamespace(before=given, sized=given)],
        final=final,
        added=final.additions,
        records=(),
        rival_in_time=None,
    )
    made_up = {
        "band_of_steps": None, "sized_models": (given, final), "free_run": SimpleNamespace(rms=1.0), "fit_stated": None,
        "_drift_left_by": STANDS_STILL,
        "step_of": SimpleNamespace(coefficient=5.0, std=1.0), "ranking_of": (LEADER,),
        "_explained_by_first_effect": 0.0, "needed_share": 0.75, "_is_loud": False,
    }  # fmt: skip
    for name, said in made_up.items():
        monkeypatch.setattr(report, name, lambda *given, said=said: said)
    monkeypatch.setattr(report, "left_by", lambda model, band: left(0.2, 10.0 if model is given else rms))

    class Asked(Exception):
        pass

    def asked(evidence, tolerance):
        raise Asked(evidence)

    monkeypatch.setattr(report, "verdict_on", asked)
    with pytest.raises(Asked) as found:
        report._answer(SimpleNamespace(place_of=str), path, DEFAULT, None)
    (evidence,) = found.value.args
    assert evidence.weighed == weighed


@pytest.mark.parametrize(
    ("effect", "coefficient", "std", "certain"),
    [
        ("channel_gain", 0.08, 0.01, True), ("channel_gain", 0.1, 0.01, False), ("channel_gain", -0.1, 0.01, False),
        ("channel_gain", 0.08, 0.09, False), ("coulomb_friction", 1e6, 1e3, True),
    ],
)  # fmt: skip
def test_what_is_certain_is_beyond_its_standard_deviation_and_short_of_its_limits(effect, coefficient, std, certain):
    steps = (SimpleNamespace(coefficient=coefficient, std=std),)
    told = SimpleNamespace(added=steps, steps=steps)
    assert report._certain([Addition(EFFECTS[effect], "target")], told) == certain


@pytest.mark.parametrize(("names", "said"), [
    (["the gain"], "; this cannot be told from a mass on these recordings"),
    (["a damper", "the gain"], "; channel_gain on barrier_fx cannot be told from a mass on these recordings"),
])  # fmt: skip
def test_it_is_said_of_each_effect_what_it_cannot_be_told_from(names, said):
    """Of a damper and a car 5 % too heavy the load cell was blamed for the mass, and no word of that."""
    gain = replace(ranked("channel_gain", "barrier_fx", 50.0), confounded_with=("a mass",))
    first, *further = [LEADER, gain][-len(names) :]
    evidence = EVIDENCE._replace(white=True, drift=NOTHING_VARIES, ranking=(first,), further=further)
    sharp = SimpleNamespace(spectra=[SimpleNamespace(passed=np.inf)])
    steps = [SimpleNamespace(name=name, effect="", evidence=50.0) for name in names]
    size = report.Rms(3.0, 0.5, 0.5)
    assert said in verdict_text._missing(evidence, DEFAULT, steps, SimpleNamespace(records=[sharp, sharp]), size)


@pytest.mark.parametrize(("effects", "share"), [
    (["friction", "damping"], 0.75), (["friction", "friction"], 0.96), (["friction"], 0.75), ([], 0.0),
    (["mass"], 0.0), (["mass", "friction"], 0.0), (["guide"], 0.75),
])  # fmt: skip
def test_what_the_first_effect_explains_is_its_share_in_the_band_wherever_it_is_missing(monkeypatch, effects, share):
    """Models that leave 10, 5 and 2 m/s^2 below the class, of which the sensors' noise is next to none; nothing of what
    has no law."""
    models = [SimpleNamespace(fit=rms, residuals=None) for rms in (10.0, 5.0, 2.0)[: len(effects) + 1]]
    monkeypatch.setattr(report, "in_band", lambda rms, residuals, cfc: InBand(rms, 0.0, 3.0, cfc))
    acts_on = {"mass": "body", "guide": "body"}

    def effect(name: str) -> SimpleNamespace:
        return SimpleNamespace(name=name, acts_on=acts_on.get(name, "element"), on_ground=name == "guide")

    added = [SimpleNamespace(effect=effect(name)) for name in effects]
    assert report._explained_by_first_effect(models, added, 60) == pytest.approx(share)


@pytest.mark.parametrize(("settled", "asked"), [(True, "as recorded"), (False, "as sized, in the sensors' noise")])
def test_whether_the_rest_varies_is_asked_of_a_motion_that_its_parameters_simulate(monkeypatch, settled, asked):
    monkeypatch.setattr(report, "analyse", lambda fit: None)
    monkeypatch.setattr(report, "settled", lambda fit, residuals: settled)
    monkeypatch.setattr(report, "drift_of", lambda fit: fit)
    fit = SimpleNamespace(problem=SimpleNamespace(on=lambda records: f"as sized, in {records}"))
    fit._replace = lambda problem: problem
    path = SimpleNamespace(as_recorded="as recorded", records="the sensors' noise")
    assert report._drift_left_by(path, SimpleNamespace(fit=fit)) == asked


def test_a_tolerance_is_a_rating_or_a_share_of_the_peak():
    assert tolerance_of("0.8") == Tolerance(rating=0.8) and tolerance_of(" 5% ") == Tolerance(of_peak=0.05)
    for wrong in ("5", "much", "", "-1%", "100%", "0", "nan", "inf%"):
        with pytest.raises(ModelError, match="0.8.*5%.*got"):
            tolerance_of(wrong)


HALF = DEFAULT._replace(of_peak=0.005)
"""Of what the default admits: without its damper the model leaves just that."""


@pytest.fixture(scope="module")
def frontal():
    """Of a model without a damper, where nothing may be added but the simulator's unloading line."""
    model = load_model("frontal_single")
    undamped = replace(model, elements=(replace(model.elements[0], damping=Coefficient()),))
    return diagnose(undamped, [read_bag(FRONTAL)], {"plastic_unloading": EFFECTS["plastic_unloading"]}, HALF)


def test_what_explains_most_is_named_though_it_leaves_more_than_noise(frontal):
    assert (frontal.verdict, frontal.complete, frontal.noise) == ("effect_missing", False, False)
    assert [(step.effect, step.target) for step in frontal.steps] == [("plastic_unloading", "car_barrier")]
    assert abs(frontal.steps[0].coefficient / 2e7 - 1.0) < 0.2
    found = frontal.as_json()
    assert found["complete"] is False and found["left"]["noise"] is False
    assert DEFAULT._asdict() == {"of_peak": 0.01, "rating": None, "stated": False}
    assert found["tolerance"] == HALF._asdict() == {"of_peak": 0.005, "rating": None, "stated": False}
    assert {"rms", "unit", "of_peak", "rating", "noise", "where"} <= found["left"].keys()
    assert found["left"]["of_peak"] == max(one["of_peak"] for one in found["left"]["where"]) < 0.02
    json.dumps(found)


def test_what_is_left_is_that_of_the_residual_below_the_class(frontal):
    final, left = frontal.models[-1], frontal.left
    assert left.cfc == 60
    of_force = next(one for one in left.channels if one.channel == "barrier_fx")
    output = [output.channel for output in final.fit.layout.outputs].index("barrier_fx")
    record, residual = final.records[0], final.residuals.residual[0][:, output]
    one = replace(record.test, channels=tuple(c for c in record.test.channels if c.name == "barrier_fx"))
    time_ns = np.round(record.time[record.at] * 1e9).astype(np.int64)
    filtered = filter_recording(Recording(one, time_ns, np.nan_to_num(residual)[:, None]), 60).values[:, 0]
    assert of_force.rms == pytest.approx(np.sqrt(np.mean(filtered**2)), rel=1e-6) and of_force.unit == "N"
    assert left.rms**2 + left.above**2 == pytest.approx(final.residuals.rms**2, rel=0.1)  # bands that hardly overlap


def test_who_says_how_good_is_good_enough_gets_a_model_that_is_adequate(monkeypatch, capsys, tmp_path):
    new = tmp_path / "new.yaml"
    told = [str(FRONTAL), "--model", "frontal_single", "--good-enough", "20%", "--apply", str(new)]
    monkeypatch.setattr("sys.argv", ["diagnose", *told])
    with pytest.raises(SystemExit) as ended:
        command.main()
    said = capsys.readouterr().out
    assert ended.value.code == 0 and said.startswith("adequate: what is left") and "20 %" in said
    assert "nothing added" in said and "effects" not in new.read_text()


def test_a_tolerance_that_is_none_is_one_clear_error(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["diagnose", str(FRONTAL), "--model", "frontal_single", "--good-enough", "fine"])
    with pytest.raises(SystemExit) as ended:
        command.main()
    assert ended.value.code == 2 and "a rating from 0 to 1" in capsys.readouterr().err


@pytest.mark.parametrize("told, applied", [([], False), (["--apply-unexplained"], True)])
def test_what_is_unexplained_is_applied_only_when_asked_for(monkeypatch, capsys, tmp_path, told, applied):
    from crash_replay.bag import write_bag

    hidden = draw_case("impactor", ["changing_mass"], 90_000_014)  # outside the vocabulary
    model, bag, new = tmp_path / "model.yaml", tmp_path / "bag.mcap", tmp_path / "new.yaml"
    model.write_text(hidden.model_text)
    write_bag(hidden.record(1.1, 0.5)[0], bag)
    monkeypatch.setattr("sys.argv", ["diagnose", str(bag), "--model", str(model), "--apply", str(new), *told])
    with pytest.raises(SystemExit) as ended:
        command.main()
    said = capsys.readouterr().out
    assert ended.value.code == 0 and said.startswith("unexplained") and " explain" in said
    assert ("effects" in new.read_text()) == applied
    assert ("--apply-unexplained" in said) != applied


def test_a_time_limit_gives_the_best_answer_so_far(frontal):
    hurried = diagnose(load_model("frontal_single"), [read_bag(FRONTAL)], seconds=1e-3)
    assert hurried.stopped and not frontal.stopped
    assert "stopped after 0.001 s" in hurried.text and "stopped" not in frontal.text
    assert hurried.verdict == "unexplained" and hurried.as_json()["stopped"] is True
    assert f"not everything was tried, and {hurried.ranking[0].name} leads so far" in hurried.text
    assert hurried.text.endswith("; signs and units of the channels were not looked at")
    assert len(hurried.ranking) >= 3 and not any(one.fitted for one in hurried.ranking)  # screened, and said to be so


@pytest.mark.parametrize("value", [4.9, 0.0])
def test_a_channel_that_never_changes_is_one_line(value):
    """It has no noise; the search ended in a fault of the program."""
    recording = read_bag(FRONTAL)
    values = recording.values.copy()
    values[:, recording.test.index("car_ax")] = value
    with pytest.raises(ModelError, match=rf"channel car_ax is {value:g} m/s\^2 throughout, as of a dead sensor: leave"):
        diagnose(load_model("frontal_single"), [Recording(recording.test, recording.time_ns, values)])
