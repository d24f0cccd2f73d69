"""How closely a recording is looked at: a crash as it is simulated, what is longer as its own motion asks for."""

import numpy as np
import pytest
from helpers_estimation import ESTIMATED, oscillator
from numpy.testing import assert_allclose, assert_array_equal

from crash_estimator.core.diagnosis.observation import pace
from crash_estimator.core.structure import Coefficient
from crash_replay.recording import Channel, Recording, Test

MASS_ON_ITS_SPRING = oscillator(ESTIMATED)


def recorded(time: np.ndarray, frequency: float) -> Recording:
    """A steady vibration of the block, in Hz."""
    channels = Channel("block_ax", "acceleration", "block", "x"), Channel("travel", "displacement")
    wave = np.sin(2.0 * np.pi * frequency * time)
    return Recording(Test("long", channels), np.rint(time * 1e9).astype(np.int64), np.column_stack([wave, wave]))


@pytest.mark.parametrize("frequency", [5.0, 20.0])
def test_a_long_record_is_stepped_by_its_own_motion(frequency):
    """The phase error of a step, (omega dt)^2 / 24, is the stated one at its highest frequency, within its bands."""
    time = np.arange(round(4.0 * pace.LONG * 1000)) * 1e-3
    step = pace.longest_step(MASS_ON_ITS_SPRING, recorded(time, frequency))
    phase = (2.0 * np.pi * frequency * step) ** 2 / 24.0
    assert step > pace.LONGEST_STEP and 0.5 * pace.PHASE < phase < 1.1 * pace.PHASE


@pytest.mark.parametrize("pulses", [0.0, 0.3])
def test_a_body_that_no_spring_brings_back_is_seen_to_turn(pulses):
    """Its speed changes by the stated share of itself in a step, RMS, be there a zero offset or not; short pulses of
    the force that moves it, which are hardly any of its speed, count by what they change of that."""
    axis = oscillator(Coefficient(0.0))
    time = np.arange(round(4.0 * pace.LONG * 1000)) * 1e-3
    turning = recorded(time, 0.5)
    turning.values[:] += pulses * np.sign(np.sin(2.0 * np.pi * 40.0 * time))[:, None]
    step = pace.longest_step(axis, turning)
    assert step == pytest.approx(pace.TURN / (np.pi * np.hypot(1.0, pulses * np.sqrt(2.0))), rel=0.02)
    turning.values[:] += 3.0
    assert pace.longest_step(axis, turning) == pytest.approx(step)


def test_a_crash_is_stepped_as_it_is_simulated_however_slow_it_is():
    """To its very end: a sample more than that long, and it is none."""
    rate = 100
    time = np.arange(round(pace.LONG * rate) + 2) / rate
    crash, longer = recorded(time[:-1], 2.0), recorded(time, 2.0)
    assert pace.longest_step(MASS_ON_ITS_SPRING, crash) == pace.LONGEST_STEP
    assert pace.longest_step(MASS_ON_ITS_SPRING, longer) > pace.LONGEST_STEP
    before = recorded(np.concatenate([[-pace.LONG], time[:-1]]), 2.0)  # what was before the impact does not count
    assert pace.longest_step(MASS_ON_ITS_SPRING, before) == pace.LONGEST_STEP


def test_means_are_of_before_the_impact_or_of_after_it_and_of_what_is_valid():
    """At the impact there is none: some of its samples may lie before a force that jumps."""
    recording = recorded(np.arange(-7, 14) * 1e-3, 0.0)
    recording.values[:, 0], recording.values[:, 1] = np.arange(21), 2.0
    recording.values[4, 0] = np.nan
    recording.values[11:15, 0] = np.nan
    found = pace._averaged(recording, 4)
    assert_array_equal(found.time_ns, [-2_500_000, 1_500_000, 5_500_000, 9_500_000])
    assert_allclose(found.values[:, 0], [(3 + 5 + 6) / 3, np.nan, np.nan, 16.5])
    assert_allclose(found.values[:, 1], [2.0, np.nan, 2.0, 2.0])


@pytest.mark.parametrize(("rate", "looked_at"), [(500, 500), (50_000, 50_000 / 7)])
def test_only_what_is_sampled_more_closely_than_it_is_stepped_is_averaged(rate, looked_at):
    time = np.arange(-round(0.01 * rate), round(0.2 * rate)) / rate
    found = pace.at_its_own_pace(MASS_ON_ITS_SPRING, recorded(time, 30.0))
    assert 1.0 / found.sample_period == pytest.approx(looked_at)
