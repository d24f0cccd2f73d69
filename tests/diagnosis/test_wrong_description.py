"""A channel whose sign or unit is wrong, by a simulation of its own: one error names it, and no effect is told."""

import re
from dataclasses import replace

import numpy as np
import pytest
import yaml
from scipy.integrate import solve_ivp

from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.diagnosis.selection.wrong_description import _is_too_much, _other_channels
from crash_estimator.core.effects import EFFECTS
from crash_estimator.model_file import ModelFile
from crash_replay.gravity import G
from crash_replay.recording import Channel, Recording, RecordingError, Test

MASSES = np.array([1000.0, 300.0])  # kg, of a cab and an engine
SPEED, RATE, BEFORE, AFTER = 12.0, 5_000, 0.03, 0.1  # m/s, Hz, s, s
NOISE = 10.0  # m/s^2, 1 g
MODEL = ModelFile.model_validate(
    yaml.safe_load(f"""
name: car
bodies:
  cab: {{mass: {MASSES[0]}, acceleration: cab_ax}}
  engine: {{mass: {MASSES[1]}, acceleration: engine_ax}}
  barrier: {{fixed: true, force: barrier_fx}}
elements:
  front:
    between: [cab, barrier]
    stiffness: {{estimate: true, initial: 300000.0, min: 0.0}}
    tension: none
  mounts:
    between: [cab, engine]
    stiffness: {{estimate: true, initial: 900000.0, min: 0.0}}
    tension: both
""")
).structure()
FEW = {name: EFFECTS[name] for name in ("coulomb_friction", "added_mass")}


def crash(friction: float = 0.0, speed: float = SPEED, test: str = "car") -> Recording:
    """friction: N, in the front while it is crushed; speed: m/s."""

    def front(crush, rate):
        return np.where(crush > 0.0, 4e5 * crush + 3e5 * crush**2 + friction * np.tanh(rate / 0.2), 0.0)

    def moves(_, state):
        x, v = state[:2], state[2:]
        mounts = 1.2e6 * (x[0] - x[1])
        return [*v, (-front(x[0], v[0]) - mounts) / MASSES[0], mounts / MASSES[1]]

    way = solve_ivp(moves, (0.0, AFTER), (0.0, 0.0, speed, speed), max_step=2e-4, rtol=1e-8, dense_output=True)
    time = np.arange(round(-BEFORE * RATE), round(AFTER * RATE)) / RATE
    state = way.sol(np.maximum(time, 0.0))
    moving = time > 0.0
    accelerations = np.array([moves(0.0, one)[2:] for one in state.T]) * moving[:, None]
    values = np.column_stack([accelerations, np.where(moving, front(state[0], state[2]), 0.0)])
    values += np.random.default_rng(3).standard_normal(values.shape) * NOISE * np.array([1.0, 1.0, MASSES.sum()])
    channels = (
        Channel("cab_ax", "acceleration", "cab", "x"),
        Channel("engine_ax", "acceleration", "engine", "x"),
        Channel("barrier_fx", "force", "barrier", "x"),
    )
    about = Test(test, channels, initial_velocity={"cab": speed, "engine": speed})
    return Recording(about, np.round(time * 1e9).astype(np.int64), values)


def times(recording: Recording, channels: str, factor: float) -> Recording:
    """channels: one, or several between commas."""
    values = recording.values.copy()
    for channel in channels.split(","):
        values[:, recording.test.index(channel)] *= factor
    return replace(recording, values=values)


def at(recording: Recording, speed: float) -> Recording:
    """As if it had been stated that all came at so many m/s."""
    return replace(recording, test=replace(recording.test, initial_velocity={"cab": speed, "engine": speed}))


@pytest.mark.parametrize(
    ("channel", "factor", "said"),
    [
        ("cab_ax", -1.0, "reversed"),
        ("engine_ax", 9.80665, "9.807 times too large"),
        ("cab_ax", 1.0 / 9.80665, "9.807 times too small"),
        ("barrier_fx", -1.0, "reversed"),
        ("cab_ax", 0.001, "1000 times too small"),
        ("barrier_fx", 0.001, "1000 times too small"),
        ("barrier_fx", 9.80665, "9.807 times too large"),
    ],
)
def test_a_channel_with_a_wrong_sign_or_unit_is_named_instead_of_an_effect(channel, factor, said):
    expected = f"^test car: channel {channel} is {said}( or .*)?, it seems: .*import it again, or the model's masses$"
    with pytest.raises(RecordingError, match=expected):
        diagnose(MODEL, [times(crash(), channel, factor)], FEW)


ACCELERATIONS = "cab_ax,engine_ax"


@pytest.mark.parametrize(
    ("factor", "said"), [(-1.0, "reversed"), (G, "9.807 times too large"), (1.0 / G, "9.807 times too small")]
)
def test_what_is_wrong_with_all_accelerations_is_said_of_all(factor, said):
    expected = f"^test car: (.* or )?channels cab_ax and engine_ax are {said}( or .*)?, it seems"
    with pytest.raises(RecordingError, match=expected):
        diagnose(MODEL, [times(crash(), ACCELERATIONS, factor)], FEW)


def test_a_speed_that_nobody_stated_is_named():
    """They lose 19 m/s, and are thrown back with some of it."""
    with pytest.raises(RecordingError, match="^test car: initial_velocity is rather 9.4 to 19 m/s, it seems"):
        diagnose(MODEL, [at(crash(), 0.0)], FEW)


def test_a_speed_that_is_far_too_small_is_said_beside_the_verdict():
    """Divided by 3.6 twice: then bodies touch later than they do, too."""
    found = diagnose(MODEL, [at(crash(), SPEED / 3.6)], FEW)
    assert found.verdict == "unexplained" and "initial_velocity is rather 9.4 to 19 m/s" in found.text


@pytest.mark.parametrize(
    ("channels", "factor", "said"),
    [
        ("barrier_fx", -1.0, "channel barrier_fx is reversed"),
        ("barrier_fx", 1000.0, "channel barrier_fx is 1000 times too large"),
        (ACCELERATIONS, G, "channels cab_ax and engine_ax are 9.807 times too large"),
    ],
)
def test_where_an_effect_is_missing_too_it_is_said_beside_the_verdict(channels, factor, said):
    """Friction of a fifth of what the front carries."""
    found = diagnose(MODEL, [times(crash(friction=5e4), channels, factor)], FEW)
    assert found.verdict == "unexplained"
    assert re.search(
        rf"; perhaps, in test car, (.* or )?{said}( or .*)?: mended, \d+% of the misfit would go", found.text
    )


def said_of(recordings: list[Recording]) -> str:
    """By an error, or beside the verdict."""
    try:
        return diagnose(MODEL, recordings, FEW).text
    except RecordingError as error:
        return str(error)


def test_of_two_recordings_the_wrong_one_is_named():
    wrong = times(crash(), "cab_ax", -1.0)
    wrong = replace(wrong, test=replace(wrong.test, id="second"))
    with pytest.raises(RecordingError, match="^test second: channel cab_ax is reversed"):
        diagnose(MODEL, [crash(), wrong], FEW)


@pytest.mark.parametrize("wrong", [0, 1])
def test_of_two_recordings_the_one_in_another_unit_is_named(wrong):
    """Whichever of them the model, which is fitted to both, happens to leave more of."""
    recordings = [crash(speed=7.0, test="slow"), crash(test="fast")]
    recordings[wrong] = times(recordings[wrong], "barrier_fx", 1e-3)
    expected = rf"test {recordings[wrong].test.id}[:,] channel barrier_fx is 1000 times too small"
    assert re.search(expected, said_of(recordings))


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ([0, 1], "initial_velocity is stated in km/h instead of m/s"),
        ([0], "initial_velocity of slow is stated in km/h instead of m/s"),
    ],
)
def test_speeds_in_another_unit_are_named_where_they_fit_each_recording_but_not_both(wrong, said):
    """A force, of a body that never comes back, is a curve over any crush: two disagree on it."""
    recordings = [crash(speed=7.0, test="slow"), crash(test="fast")]
    for k in wrong:
        recordings[k] = at(recordings[k], 3.6 * recordings[k].test.initial_velocity["cab"])
    assert re.search(rf"tests slow and fast[:,] {said}", said_of(recordings))


def test_an_effect_that_makes_up_most_of_a_force_is_named_all_the_same():
    """Half of what the front carries; of a car that hardly slows down any force would be a curve over its crush."""
    found = diagnose(MODEL, [crash(friction=1e5)], FEW)
    assert (found.verdict, found.steps[0].name) == ("effect_missing", "coulomb_friction on front"), found.text


@pytest.mark.parametrize(("factor", "too_fast"), [(1.0, False), (2.0, False), (9.8, True)])
def test_a_body_is_too_fast_that_is_thrown_back_at_more_than_it_came_with(factor, too_fast):
    recording = crash()
    assert _is_too_much(MODEL, times(recording, "cab_ax", factor), ["cab_ax"], "acceleration") == too_fast
    alone = replace(recording, test=replace(recording.test, initial_velocity={}))
    assert (
        _is_too_much(MODEL, times(alone, "cab_ax", factor), ["cab_ax"], "acceleration") == too_fast
    )  # than the engine


@pytest.mark.parametrize("speed", [SPEED, 0.0])
def test_a_force_is_asked_for_in_the_units_that_the_stated_speeds_allow(speed):
    """Without them, in all: a force that is right takes no more than twice what the bodies bring."""
    asked = {what for what, _ in _other_channels(MODEL, at(crash(), speed))}
    large, small = (f"channel barrier_fx is 1000 times too {way}" for way in ("large", "small"))
    assert (large in asked, small in asked) == ((False, False) if speed else (True, True))
    assert small in {what for what, _ in _other_channels(MODEL, times(at(crash(), speed), "barrier_fx", 1e-3))}
    assert large in {what for what, _ in _other_channels(MODEL, times(at(crash(), speed), "barrier_fx", 1e3))}
