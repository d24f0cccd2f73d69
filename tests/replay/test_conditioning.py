"""Zero offset, SAE J211 filters, integration, choice of channels."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.signal import butter

from crash_replay.conditioning import (
    CFC_CLASSES,
    cfc_coefficients,
    cfc_filter,
    filter_recording,
    integrate,
    pre_impact_offset,
    remove_offset,
    select_channels,
)
from crash_replay.recording import Channel, Recording, RecordingError, Test

PERIOD = 1e-4  # s


def recording(values, quantities=("acceleration",), first=-100, period_ns=100_000):
    values = np.asarray(values, dtype=float).reshape(-1, len(quantities))
    channels = tuple(Channel(f"c{k}", quantity, axis="x") for k, quantity in enumerate(quantities))
    return Recording(Test("T", channels), (np.arange(len(values)) + first) * period_ns, values)


# ---- zero offset


def test_offset_is_the_mean_before_the_impact_and_is_said():
    values = np.full((200, 2), 3.0)
    values[100:] += 50.0
    values[:100, 1] += np.tile([1.0, -1.0], 50)
    changed = remove_offset(recording(values, ("acceleration", "force")))
    assert_allclose(changed.values[:100].mean(axis=0), 0.0, atol=1e-14)
    assert_allclose(changed.values[100:], 50.0)
    assert changed.test.notes == ("pre-impact mean removed: c0 3 m/s^2, c1 3 N",)


def test_velocity_and_displacement_before_the_impact_are_facts():
    before = recording(np.full((200, 2), 15.0), ("velocity", "displacement"))
    assert np.isnan(pre_impact_offset(before)).all()
    assert_array_equal(remove_offset(before).values, before.values)


def test_too_few_samples_keep_the_offset_and_say_so():
    short = recording(np.full(50, 3.0), first=-19)
    assert_array_equal(remove_offset(short).values, short.values)
    assert remove_offset(short).test.notes == ("zero offset kept, fewer than 20 samples before time zero: c0",)
    assert_allclose(remove_offset(recording(np.full(50, 3.0), first=-20)).values, 0.0)


def test_offset_ignores_what_is_not_valid():
    values = np.full(200, 2.0)
    values[10:40] = np.nan
    changed = remove_offset(recording(values)).values[:, 0]
    assert_array_equal(np.isnan(changed), np.isnan(values))
    assert_allclose(changed[~np.isnan(values)], 0.0)


# ---- SAE J211-1


@pytest.mark.parametrize("cfc", CFC_CLASSES)
@pytest.mark.parametrize("rate", [10e3, 12.5e3, 50e3])
def test_coefficients_are_the_butterworth_design(cfc, rate):
    numerator, denominator = cfc_coefficients(cfc, 1.0 / rate)
    expected = butter(2, 2.0775 * cfc, fs=rate)
    assert_allclose(numerator, expected[0], rtol=1e-12)
    assert_allclose(denominator, expected[1], rtol=1e-12)


def gain_db(cfc, frequency, rate=20e3):
    """Of a long sine's middle."""
    t = np.arange(int(rate * 2.0)) / rate
    middle = slice(len(t) // 4, -len(t) // 4)
    filtered = cfc_filter(np.sin(2 * np.pi * frequency * t), 1.0 / rate, cfc)[middle]
    return 10 * np.log10(2.0 * np.mean(filtered**2))


@pytest.mark.parametrize("cfc", CFC_CLASSES)
def test_gain_stays_in_the_corridor_of_sae_j211(cfc):
    """SAE J211-1 figure 1: +-0.5 dB up to 0.1 F_H, +0.5/-1 dB at F_H = CFC, +0.5/-4 dB at F_N = 1.65 F_H.

    Above F_N the data channel falls by 9 dB an octave or more, to -30 dB or below at the end.
    """
    f_n = cfc / 0.6
    assert abs(gain_db(cfc, 0.1 * cfc)) < 0.5
    assert -1.0 < gain_db(cfc, cfc) < 0.5
    assert -4.0 < gain_db(cfc, f_n) < 0.5
    # two passes of the cut-off frequency 2.0775 CFC: -3 dB where (f/fc)^4 = sqrt(2) - 1, below 1 % pre-warping
    assert_allclose(gain_db(cfc, f_n), -3.0, atol=0.25)
    assert gain_db(cfc, f_n * 2**1.5) < -4.0 - 9.0 * 1.5 + 4.0
    assert gain_db(cfc, min(f_n * 5, 9.9e3)) < -30.0


def test_minus_three_decibel_at_the_named_frequencies():
    for cfc, frequency in {60: 100.0, 180: 300.0, 600: 1000.0, 1000: 1650.0}.items():
        assert_allclose(gain_db(cfc, frequency, rate=100e3), -3.0, atol=0.1)


@pytest.mark.parametrize("cfc", CFC_CLASSES)
def test_filter_keeps_a_constant_and_a_peak_in_place(cfc):
    assert_allclose(cfc_filter(np.full(500, -4.0), PERIOD, cfc), -4.0, rtol=1e-10)
    t = (np.arange(2001) - 1000) * PERIOD
    assert np.argmax(cfc_filter(np.exp(-((t / 5e-3) ** 2)), PERIOD, cfc)) == 1000


@pytest.mark.parametrize("cfc", CFC_CLASSES)
def test_filter_has_no_transient_at_the_ends(cfc):
    """A straight line goes through unchanged, from its first value to its last: the end is extended, not cut off."""
    ramp = np.linspace(-20.0, 30.0, 600)
    # 10 ms of extension is 5 time constants of the slowest class: 1 % of the line's rise over 10 ms
    assert_allclose(cfc_filter(ramp, PERIOD, cfc), ramp, atol=0.01 * 50.0 * 100 / 600)


@given(st.lists(st.floats(-1e4, 1e4), min_size=1, max_size=40), st.floats(-3, 3), st.sampled_from(CFC_CLASSES))
def test_filter_is_linear_and_reversible_in_time(values, factor, cfc):
    values = np.array(values)
    filtered = cfc_filter(values, PERIOD, cfc)
    scale = 1e-9 * (1 + np.abs(values).max())
    assert_allclose(cfc_filter(factor * values, PERIOD, cfc), factor * filtered, atol=10 * scale)
    assert filtered.shape == values.shape and np.isfinite(filtered).all()


def test_stretches_between_missing_values_are_filtered_on_their_own():
    rng = np.random.default_rng(1)
    values = rng.normal(size=400)
    values[[0, 150, 151, 200, 202]] = np.nan
    filtered = cfc_filter(values, PERIOD, 180)
    assert_array_equal(np.isnan(filtered), np.isnan(values))
    assert_array_equal(filtered[1:150], cfc_filter(values[1:150], PERIOD, 180))
    assert filtered[201] == pytest.approx(values[201])  # one value alone: nothing to filter with


def test_filter_says_what_it_cannot_do():
    with pytest.raises(RecordingError, match="CFC must be one of 60, 180, 600, 1000, got 61"):
        cfc_filter(np.zeros(10), PERIOD, 61)
    with pytest.raises(RecordingError, match="CFC 1000 needs a sample rate of at least 10000 Hz, got 5000 Hz"):
        cfc_filter(np.zeros(10), 2e-4, 1000)
    with pytest.raises(RecordingError, match=r"CFC 60 needs .* got none \(one sample\)"):
        filter_recording(recording([1.0]), 60)
    uneven = Recording(Test("T", (Channel("c", "force"),)), np.array([0, 100, 200, 400, 500]) * 1000, np.zeros((5, 1)))
    with pytest.raises(
        RecordingError, match="equal time steps, but the step at 0.000200 s is 0.2 ms where most are 0.1"
    ):
        filter_recording(uneven, 60)


def test_filter_recording_filters_every_channel_and_says_so():
    rng = np.random.default_rng(2)
    raw = recording(rng.normal(size=(300, 2)), ("acceleration", "displacement"))
    filtered = filter_recording(raw, 180)
    for k in range(2):
        assert_array_equal(filtered.values[:, k], cfc_filter(raw.values[:, k], raw.sample_period, 180))
    assert filtered.test.notes == ("filtered with CFC 180 (SAE J211-1), all channels",)
    assert_array_equal(raw.values, np.random.default_rng(2).normal(size=(300, 2)))  # the input is as it was


# ---- integration


def test_integration_is_exact_for_a_straight_acceleration_at_uneven_steps():
    t = np.array([-0.02, -0.01, 0.0, 0.001, 0.004, 0.005, 0.02])
    v, x = integrate(t, 100.0 + 2000.0 * t, initial_velocity=-3.0, initial_displacement=0.5)
    after = t >= 0
    s = t[after]
    assert_allclose(v[after], -3.0 + 100 * s + 1000 * s**2, rtol=1e-12)
    assert_allclose(x[after], 0.5 - 3.0 * s + 50 * s**2 + 2000 / 6 * s**3, rtol=1e-12)
    assert_array_equal(v[~after], -3.0)
    assert_allclose(x[~after], 0.5 - 3.0 * t[~after])


def test_integration_starts_at_time_zero_even_between_samples_and_bridges_gaps():
    t = np.array([-0.5, 0.5, 1.5, 2.5]) * 1e-3
    v, x = integrate(t, np.array([9.0, 2.0, np.nan, 2.0]))
    assert_allclose(v, [0.0, 1e-3, 3e-3, 5e-3])
    assert_allclose(x, [0.0, 0.25e-6, 2.25e-6, 6.25e-6])
    v, x = integrate(np.array([-2.0, -1.0]), np.array([1.0, 1.0]), 4.0)
    assert_array_equal(v, 4.0)
    assert_array_equal(x, [-8.0, -4.0])


@given(st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=30), st.floats(-20, 20))
def test_integration_is_linear_in_the_acceleration(values, initial):
    a = np.array(values)
    t = np.arange(len(a)) * 1e-3
    v, x = integrate(t, a, initial)
    v2, x2 = integrate(t, 2 * a, initial)
    assert_allclose(v2 - initial, 2 * (v - initial), atol=1e-9)
    assert_allclose(x2 - initial * t, 2 * (x - initial * t), atol=1e-9)


# ---- choice


def test_select_channels_by_pattern():
    whole = recording(np.arange(30.0), ("force",) * 3)
    chosen = select_channels(whole, ["c2", "c0*"])
    assert chosen.test.channel_names == ("c0", "c2")
    assert_array_equal(chosen.values, whole.values[:, [0, 2]])
    assert chosen.test.notes == ("left out, not asked for: c1",)
    with pytest.raises(RecordingError, match="no channel matches 'd\\*'; channels: c0, c1, c2"):
        select_channels(whole, ["c0", "d*"])
