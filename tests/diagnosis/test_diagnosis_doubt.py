"""Whether a diagnosis warns that the model itself may be wrong: of models that were made wrong, not of right ones."""

import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import yaml
from helpers_paths import BAGS

from crash_estimator.cli import diagnose as command
from crash_estimator.cli import estimate
from crash_estimator.core.diagnosis.report.diagnosis import Diagnosis, diagnose
from crash_estimator.diagnosis_doubt import doubt
from crash_estimator.model_file import load_model
from crash_estimator.ready_models import model_path
from crash_replay.bag import read_bag

HIDDEN = str(BAGS / "hidden_effect.model.yaml")
ADVICE = "check its bodies, masses and attachments, and units, signs and initial velocities"
RESTS = "rib 0, pelvis 0, spine 0 m/s"


@cache
def found(bag: str, model: str) -> Diagnosis:
    return diagnose(load_model(model), [read_bag(BAGS / f"{bag}.mcap")])


@pytest.mark.parametrize("bag, model", [("hidden_effect", HIDDEN), ("side_dummy_unpadded", "side_dummy")])
def test_a_right_model_is_not_doubted_whether_or_not_an_effect_is_missing(bag, model):
    assert doubt(found(bag, model)) == ""


def said_of_a_share_of_the_mass(share: float, monkeypatch, folder) -> int:
    """What the command ends with, of the bag's car."""
    model = yaml.safe_load(Path(model_path("frontal_single")).read_text())
    model["bodies"]["car"]["mass"] *= share
    wrong = folder / "wrong.yaml"
    wrong.write_text(yaml.safe_dump(model))
    monkeypatch.setattr(sys, "argv", ["diagnose", str(BAGS / "frontal_single.mcap"), "--model", str(wrong)])
    with pytest.raises(SystemExit) as status:
        command.main()
    return status.value.code


def test_a_model_that_explains_little_and_is_not_mended_is_doubted_below_the_verdict(monkeypatch, capsys, tmp_path):
    """A fifth of the mass: the force calls for five times the acceleration. Nobody weighs a body so wrong, as is said
    of the added mass that would mend most of it, beside a second effect."""
    status = said_of_a_share_of_the_mass(0.2, monkeypatch, tmp_path)
    said = capsys.readouterr().out.splitlines()
    assert status == 0 and said[0].startswith("unexplained")
    text = (
        "the model itself or the recording may be wrong (as given it explains {}% of car_ax, added_mass on car is as "
        "large as it may be, 343.8 kg): " + ADVICE + " (car 13.3 m/s)"
    )
    assert said[1] in {text.format(share) for share in (26, 27, 28)} and said[2] == ""


def test_of_a_mass_that_looks_like_a_unit_it_is_said_that_it_may_be_the_mass(monkeypatch, capsys, tmp_path):
    """A tenth of it: the force calls for about 9.81 times the acceleration."""
    status, said = said_of_a_share_of_the_mass(0.1, monkeypatch, tmp_path), capsys.readouterr()
    assert status == 1 and not said.out
    assert "barrier_fx is 9.807 times too large" in said.err and "or the model's masses" in said.err


def test_an_element_that_is_written_the_wrong_way_round_is_named(monkeypatch, capsys, tmp_path):
    """Crush is the first body's way less the second's: the other way round a barrier is never run into."""
    model = yaml.safe_load(Path(model_path("frontal_single")).read_text())
    (name,) = model["elements"]
    model["elements"][name]["between"].reverse()
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text(yaml.safe_dump(model))
    why = f"{name} never touches (the first body of its `between` is the one that runs into the other)"
    for tool, tail in ((command, "as given it explains 0% of"), (estimate, "")):
        monkeypatch.setattr(sys, "argv", ["tool", str(BAGS / "frontal_single.mcap"), "--model", str(wrong)])
        with pytest.raises(SystemExit):
            tool.main()
        said = capsys.readouterr().out
        assert why in said and tail in said


def test_a_stack_of_effects_is_doubted_though_they_leave_only_noise():
    one = found("hidden_effect", HIDDEN)
    assert doubt(replace(one, steps=one.steps * 2)) == ""
    assert doubt(replace(one, steps=one.steps * 3)) == (
        f"the model itself or the recording may be wrong (it takes 3 effects to mend it): {ADVICE} ({RESTS})"
    )


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_effect_as_large_as_is_admitted_is_doubted(sign):
    """The limit is moved to where the coefficient is; of a coefficient below zero it is the lower one."""
    one = found("hidden_effect", HIDDEN)
    last = one.models[-1]
    layout, theta = last.fit.layout, sign * last.fit.theta
    (place,) = layout.terms
    limits = [np.full(layout.size, -np.inf), np.full(layout.size, np.inf)]

    def limited(share: float) -> str:
        limits[sign > 0.0][place.coefficient] = theta[place.coefficient] * share
        prior = layout.prior._replace(low=limits[0], high=limits[1])
        fitted = last.fit._replace(theta=theta, problem=last.fit.problem._replace(layout=layout._replace(prior=prior)))
        return doubt(replace(one, models=(*one.models[:-1], last._replace(fit=fitted))))

    assert limited(1.1) == ""
    reason = f"coulomb_friction on rib_spine is as large as it may be, {theta[place.coefficient]:g} N"
    assert limited(1.0) == f"the model itself or the recording may be wrong ({reason}): {ADVICE} ({RESTS})"
