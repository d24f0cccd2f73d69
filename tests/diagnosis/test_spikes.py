"""Spikes, which no body has felt, are left out and said; what bodies may feel stays."""

import numpy as np
import pytest
from helpers_paths import BAGS

from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.spikes import spikes
from crash_estimator.model_file import load_model
from crash_replay.bag import read_bag
from crash_replay.recording import Recording

PERIOD = 1e-4  # s


@pytest.fixture(scope="module")
def padded() -> Recording:
    return read_bag(BAGS / "side_dummy_padded.mcap")


def spiked(recording: Recording, channel: str, at: dict[int, float]) -> Recording:
    """at: sample -> what is added to it and the next, SI."""
    values, k = recording.values.copy(), recording.test.index(channel)
    for sample, height in at.items():
        values[sample : sample + 2, k] += height
    return Recording(recording.test, recording.time_ns, values)


@pytest.mark.parametrize("at", [{700: 600.0}, {600: 800.0, 900: -500.0}])
def test_they_are_found_and_nothing_beside_them(padded, at):
    column = spiked(padded, "rib_ay", at).column("rib_ay")
    assert np.flatnonzero(spikes(column, PERIOD)).tolist() == sorted(k + n for k in at for n in (0, 1))
    assert not spikes(padded.column("rib_ay"), PERIOD).any()


def test_a_right_model_of_a_recording_with_a_spike_is_adequate(padded):
    found = diagnose(load_model("side_dummy"), [spiked(padded, "door_lower_ay", {700: 600.0})])
    assert found.verdict == "adequate", found.text
    assert "door_lower_ay of side_dummy_padded has spikes, 2 samples left out" in found.text


@pytest.mark.parametrize(
    ("what", "values"),
    [
        ("a force that jumps", np.where(np.arange(2000) > 700, 300.0, 0.0)),
        ("a short blow", np.where(np.abs(np.arange(2000) - 700) < 3, 600.0, 0.0)),
        ("ringing", 600.0 * np.exp(-np.arange(2000) / 30.0) * np.sin(2.5 * np.arange(2000))),
        ("no noise", np.where(np.arange(2000) == 700, 600.0, 0.0)),
    ],
)
def test_what_may_be_felt_is_none(what, values):
    noise = 0.0 if what == "no noise" else 3.0
    assert not spikes(values + np.random.default_rng(5).normal(0.0, noise, len(values)), PERIOD).any(), what


def test_of_what_is_sampled_slowly_nothing_is_too_short_to_be_felt(padded):
    column = spiked(padded, "rib_ay", {700: 600.0}).column("rib_ay")
    assert not spikes(column, 1e-3).any()
