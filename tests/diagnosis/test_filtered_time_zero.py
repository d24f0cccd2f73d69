"""A time zero that is stated wrongly, of signals that a filter shows before they begin: a half sine, a mass against a
spring that carries compression only, which needs no simulator."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.diagnosis.report.tolerance import DEFAULT, tolerance_of
from crash_estimator.core.diagnosis.selection import onset_search
from crash_estimator.core.diagnosis.selection.onset_search import Begun
from crash_estimator.core.diagnosis.selection.time_zero import Shift
from crash_estimator.model_file import ModelFile
from crash_replay.conditioning import filter_recording
from crash_replay.onset import find_onset
from crash_replay.recording import Channel, Recording, Test

MASS, STIFFNESS = 1000.0, 5e5  # kg, N/m
MODEL = """
name: half sine
bodies:
  car: {mass: 1000, acceleration: car_ax}
  barrier: {fixed: true, force: barrier_fx}
elements:
  front: {between: [car, barrier], stiffness: {estimate: true, initial: 300000, min: 0, shape: constant}, tension: none}
"""


def crash(speed: float, late: float, cfc: int, gap: float = 0.0, seed: int = 0) -> Recording:
    """10 kHz, noise of 1 % of the peak, filtered; late: s by which the motion begins after the stated time zero."""
    time = np.arange(-400, 2400) * 1e-4
    omega = np.sqrt(STIFFNESS / MASS)
    phase = omega * (time - late - gap / speed)
    wave = np.where((phase > 0.0) & (phase < np.pi), np.sin(phase), 0.0)
    peaks = speed * omega * np.array([-1.0, MASS])  # m/s^2, N
    noise = 0.01 * np.random.default_rng([seed, int(10 * speed)]).standard_normal((len(time), 2))
    channels = (Channel("car_ax", "acceleration", "car", "x"), Channel("barrier_fx", "force", "barrier", "x"))
    test = Test(f"{speed:g} m/s", channels, initial_velocity={"car": speed})
    return filter_recording(Recording(test, np.arange(-400, 2400) * 100_000, peaks * (wave[:, None] + noise)), cfc)


def diagnosed(tolerance=DEFAULT, **of_crash):
    model = ModelFile.model_validate(yaml.safe_load(MODEL)).structure()
    return diagnose(model, [crash(speed, **of_crash) for speed in (7.0, 13.0)], tolerance=tolerance)


@pytest.mark.parametrize(("late", "cfc"), [(3e-3, 60), (1e-3, 180)])
def test_a_time_zero_of_filtered_signals_is_told_without_a_gap(late, cfc):
    """At each speed another time zero and a gap begin the motion together: 29 mm of gap stood beside -2.8 ms."""
    found = diagnosed(late=late, cfc=cfc)
    (zero,) = found.steps
    assert (found.verdict, found.complete, zero.effect) == ("effect_missing", True, "time_zero")
    assert all(abs(seconds - late) < 1.5e-4 for seconds in zero.shape.values()) and len(zero.shape) == 2


def test_who_tolerates_what_a_wrong_time_zero_leaves_hears_from_where_it_was_compared():
    """What is left was told as falling, by nothing that was added."""
    found = diagnosed(tolerance_of("60%"), late=-3e-3, cfc=60)
    assert (found.verdict, found.steps) == ("adequate", ()) and found.residual_rms.before == found.residual_rms.after
    assert found.text.endswith(" from the stated time zero, and are compared from there on")


def test_a_gap_of_filtered_signals_is_told_without_a_time_zero():
    found = diagnosed(late=0.0, cfc=60, gap=0.01)
    (step,) = found.steps
    assert (found.verdict, step.effect) == ("effect_missing", "clearance") and abs(step.coefficient - 0.01) < 5e-4


def test_filtered_signals_that_are_seen_early_lack_nothing():
    found = diagnosed(late=0.0, cfc=60)
    assert found.verdict == "adequate" and "the signals begin" not in found.text


def damped_crash(speed: float) -> Recording:
    """A damper beside the spring, whose force jumps at contact, without noise."""
    damping = 0.25 * 2.0 * np.sqrt(STIFFNESS * MASS)
    still = crash(speed, 0.0, 60)
    decay, time = damping / (2.0 * MASS), still.time
    swing = np.sqrt(STIFFNESS / MASS - decay**2)
    inside = (time >= 0.0) & (time < np.pi / swing)
    fading = speed / swing * np.exp(-decay * time)
    x = np.where(inside, fading * np.sin(swing * time), 0.0)
    v = np.where(inside, fading * (swing * np.cos(swing * time) - decay * np.sin(swing * time)), 0.0)
    force = STIFFNESS * x + damping * v
    return replace(still, values=np.stack([-force / MASS, force], axis=1))


def noisy(recording: Recording, of_peak: float) -> Recording:
    white = np.random.default_rng(len(recording.test.id)).standard_normal(recording.values.shape)
    peaks = np.abs(recording.values).max(axis=0)
    return replace(recording, values=recording.values + of_peak * peaks * white)


def diagnosed_damped(recordings):
    damped = MODEL.replace("tension: none", "damping: {estimate: true, initial: 9000, min: 0}, tension: none")
    return diagnose(ModelFile.model_validate(yaml.safe_load(damped)).structure(), recordings)


@pytest.mark.parametrize("cfc", [60, 180])
def test_a_force_that_jumps_at_contact_behind_a_filter_that_nothing_tells_lacks_nothing(cfc):
    """Its jump is seen before time zero, and as long after it what was before. The noise, 0.2 % of the peak, is white:
    it was added behind the filter and does not tell of it."""
    crashes = [noisy(filter_recording(damped_crash(speed), cfc), 2e-3) for speed in (7.0, 13.0)]
    found = diagnosed_damped(crashes)
    assert found.verdict == "adequate" and found.complete
    (damping,) = (one.value for one in found.constants if one.constant == "damping")
    assert abs(damping / (0.25 * 2.0 * np.sqrt(STIFFNESS * MASS)) - 1.0) < 0.02


def test_a_loud_jump_that_a_filter_shows_from_afar_begins_at_its_time_zero():
    """In noise of 0.5 % of the peak before the filter the onset comes more than half a period early."""
    crashes = [filter_recording(noisy(damped_crash(speed), 5e-3), 60) for speed in (7.0, 13.0)]
    assert max(-find_onset(one).time for one in crashes) > 8.1e-3
    found = diagnosed_damped(crashes)
    assert found.verdict == "adequate" and "the signals begin" not in found.text


def test_a_motion_may_begin_as_much_later_than_its_onset_as_the_filter_shows_it_early():
    onset = Shift(0, "test", -2e-3, 1e-4, 1e-4, early=8e-3)
    assert [round(onset.off(at), 6) for at in (-3e-3, -2e-3, 0.0, 6e-3, 7e-3)] == [-1e-3, 0.0, 0.0, 0.0, 1e-3]


@pytest.mark.parametrize(("from_onset", "as_stated", "taken"), [
    (True, True, True), (False, False, True), (False, True, False),
])  # fmt: skip
def test_an_early_onset_is_not_taken_where_only_what_is_found_without_it_leaves_noise(
    monkeypatch, from_onset, as_stated, taken
):
    """A filter shows a force that jumps at contact long before it: with the damper that jumps nothing is early."""
    early = Shift(0, "test", -9e-3, 1e-4, 1e-4, early=8e-3)
    stated, moved = [SimpleNamespace(onset_early=8e-3)], [SimpleNamespace(onset_early=8e-3)]
    paths = {id(moved): SimpleNamespace(noise=from_onset), id(stated): SimpleNamespace(noise=as_stated)}
    search = onset_search._Search
    monkeypatch.setattr(onset_search, "onsets", lambda recordings: (early,))
    monkeypatch.setattr(onset_search, "as_given", lambda *given: (None, SimpleNamespace(white=False)))
    monkeypatch.setattr(search, "_may_be_explained_open", lambda self: False)
    zero = SimpleNamespace(shifts=(early,))
    monkeypatch.setattr(search, "_begins_early", lambda self, given, early: zero)
    monkeypatch.setattr(search, "_may_begin_elsewhere", lambda self, path, elsewhere: False)
    monkeypatch.setattr(search, "_observed", lambda self, shifts=(): moved if shifts else stated)
    monkeypatch.setattr(search, "_selected", lambda self, records: paths[id(records)])
    found = search(SimpleNamespace(bodies=()), (), {}).begun()
    assert found == (Begun(paths[id(moved)], zero, ()) if taken else Begun(paths[id(stated)], None, (early,)))
