"""A mass that hangs in a car, which no sensor shows, is named; its truth is simulated by scipy's integrator."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from helpers_hung import DAMPING, ENGINE, FREQUENCY, MODEL, crash, hung_model

from crash_estimator.cli.work.diagnose import apply
from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.diagnosis.observation.record import observe
from crash_estimator.core.diagnosis.parameterization.magnitudes import measure_magnitudes
from crash_estimator.core.diagnosis.selection.candidates import candidates
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.effect import Addition
from crash_estimator.model_file import load_model
from crash_replay.recording import Channel, Recording


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


def sought(structure, recording: Recording) -> set[str]:
    """Where a mass that hangs is looked for."""
    magnitudes = measure_magnitudes(structure, [observe(structure, recording)])
    every = candidates(magnitudes, {"unmodelled_body": EFFECTS["unmodelled_body"]})
    return {one.target for one in every if one.variant == "hung"}


def test_it_is_sought_where_more_than_the_body_s_own_acceleration_shows_it_and_no_sensor_is_left():
    """Alone it may be a sensor on a body that rotates; and what has a sensor is not supposed without one."""
    recording = crash(12.0, 8)
    assert sought(hung_model(), recording) == {"car"}
    alone = replace(hung_model(), bodies=tuple(replace(body, force=None) for body in hung_model().bodies))
    assert not sought(alone, recording)
    assert not sought(hung_model(), with_a_sensor(recording, recording.values[:, 0]))


@pytest.mark.parametrize("spare", [
    np.full(1, 30.0), np.full(1, np.nan), np.random.default_rng(9).normal(0.0, 5.0, len(crash(12.0, 8))),
], ids=["dead", "empty", "at rest"])  # fmt: skip
def test_a_sensor_that_shows_no_motion_is_none(spare):
    recording = with_a_sensor(crash(12.0, 8), np.resize(spare, len(crash(12.0, 8))))
    assert sought(hung_model(), recording) == {"car"}


def with_a_sensor(recording: Recording, values: np.ndarray) -> Recording:
    channels = (*recording.test.channels, Channel("engine_ax", "acceleration", "engine"))
    both = np.column_stack([recording.values, values])
    return replace(recording, test=replace(recording.test, channels=channels), values=both)


@pytest.mark.parametrize(
    "shapes, mass, doubted",
    [((22.0, 0.1), ENGINE, False), ((22.0, 0.7), ENGINE, True), ((3.0, 0.1), ENGINE, True), ((22.0, 0.1), 5.0, True)],
)
def test_what_does_not_swing_or_is_next_to_nothing_is_not_told(shapes, mass, doubted):
    hung, magnitudes = EFFECTS["unmodelled_body"], SimpleNamespace(structure=hung_model())
    shapes = dict(zip(("frequency", "damping"), shapes, strict=True))
    assert hung.is_doubt(magnitudes, Addition(hung, "car", variant="hung"), mass, shapes, None) == doubted
