"""A mass that hangs in a car, which no sensor shows, is named; its truth is simulated by scipy's integrator."""

from dataclasses import replace

import numpy as np
import pytest
from helpers_hung import DAMPING, ENGINE, FREQUENCY, MODEL, crash, hung_model

from crash_estimator.cli.work.diagnose import apply
from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.effects import EFFECTS
from crash_estimator.model_file import load_model
from crash_replay.recording import Recording


@pytest.fixture(scope="module")
def found():
    return diagnose(hung_model(), [crash(10.0, 1), crash(13.0, 2)])


def test_it_is_named_with_its_mass_and_how_it_hangs(found):
    assert (found.verdict, found.complete) == ("effect_missing", True), found.text
    (step,) = found.steps
    assert (step.effect, step.target) == ("unmodelled_body", "car") and "(hung)" in found.text
    assert step.coefficient == pytest.approx(ENGINE, rel=0.05)
    assert found.structure.effects[0].shape["frequency"] == pytest.approx(FREQUENCY, rel=0.03)
    assert found.structure.effects[0].shape["damping"] == pytest.approx(DAMPING, rel=0.3)


def test_a_model_file_says_it_and_then_nothing_is_missing(found, tmp_path):
    model, target = tmp_path / "car.yaml", tmp_path / "with_it.yaml"
    model.write_text(MODEL)
    assert apply(found, (), EFFECTS, str(model), str(target)) == "unmodelled_body on car"
    assert "body: car" in target.read_text() and "form: hung" in target.read_text()
    again = diagnose(load_model(target), [crash(10.0, 3), crash(13.0, 4)])
    assert (again.verdict, again.complete) == ("adequate", True), again.text


def test_where_nothing_hangs_nothing_is_named():
    found = diagnose(hung_model(), [crash(10.0, 5, engine=0.0), crash(13.0, 6, engine=0.0)])
    assert (found.verdict, found.complete) == ("adequate", True), found.text


def by_recorder(recording: Recording, bits: int) -> Recording:
    """As a recorder of so few bits writes it that the noise at rest shows in none of them."""
    step = 2.0 * np.abs(recording.values).max(axis=0) / 2**bits
    return replace(recording, values=step * np.round(recording.values / step))


@pytest.mark.parametrize("engine, verdict", [(ENGINE, "effect_missing"), (0.0, "adequate")])
def test_the_step_of_a_coarse_recorder_is_its_noise(engine, verdict):
    recordings = [by_recorder(crash(speed, 7, engine, noise=0.02, rate=2000.0), bits=8) for speed in (10.0, 13.0)]
    assert not recordings[0].values[recordings[0].time < 0.0].any()
    found = diagnose(hung_model(), recordings)
    assert (found.verdict, found.complete) == (verdict, True), found.text
