"""A channel that is dead for a while is left out there, and said; what rests, and what has no noise, stays."""

import numpy as np
import pytest
from helpers_paths import BAGS

from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.dropouts import dropouts
from crash_estimator.model_file import load_model
from crash_replay.bag import read_bag
from crash_replay.recording import Recording


def dead(recording: Recording, channel: str, samples: slice, at: float | None = None) -> Recording:
    """Its numbers are `at`, or the last one before."""
    values, k = recording.values.copy(), recording.test.index(channel)
    values[samples, k] = values[samples.start - 1, k] if at is None else at
    return Recording(recording.test, recording.time_ns, values)


@pytest.fixture(scope="module")
def padded() -> Recording:
    return read_bag(BAGS / "side_dummy_padded.mcap")


def test_a_dead_channel_is_found_and_nothing_else(padded):
    lost = dropouts(dead(padded, "rib_ay", slice(700, 740), 0.0).column("rib_ay"))
    assert np.flatnonzero(lost).tolist() == list(range(700, 740))
    assert not any(dropouts(column).any() for column in padded.values.T)


def test_a_channel_that_dies_for_good_is_found(padded):
    peak = int(np.argmax(np.abs(padded.column("rib_ay"))))
    lost = dropouts(dead(padded, "rib_ay", slice(peak, None), 0.0).column("rib_ay"))
    assert np.flatnonzero(lost).tolist() == list(range(peak, len(padded)))


def test_a_right_model_of_a_recording_with_a_dead_channel_is_adequate(padded):
    found = diagnose(load_model("side_dummy"), [dead(padded, "rib_ay", slice(700, 740), 0.0)])
    assert found.verdict == "adequate", found.text
    assert "rib_ay of side_dummy_padded is dead for a while, 40 samples left out" in found.text


NOISE = np.random.default_rng(6).normal(0.0, 2.0, 3000)
PULSE = 300.0 * np.sin(np.pi * np.clip(np.arange(3000) / 1500.0, 0.0, 1.0))


@pytest.mark.parametrize(
    ("what", "values"),
    [
        ("noise of less than its numbers' steps", np.round((PULSE + 0.1 * NOISE) / 2.0) * 2.0),
        ("a pulse that comes to rest", np.where(np.arange(3000) < 1500, PULSE + NOISE, 0.0)),
        ("no noise", np.where(np.arange(3000) // 100 == 5, 0.0, PULSE)),
        ("holes", np.where(np.arange(3000) // 100 == 5, np.nan, PULSE + NOISE)),
        ("three samples by chance", np.where(np.arange(3000) // 3 == 200, 7.0, np.round(PULSE + NOISE))),
    ],
)
def test_what_is_no_fault_stays(what, values):
    assert not dropouts(values).any(), what
