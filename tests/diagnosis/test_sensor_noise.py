"""Sensors as they are: coloured, filtered, ringing, with zeros that drift, on bodies whose masses are off by a percent.

The cases are the second generator's, of its development seeds."""

import re
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from helpers_verdict import EVIDENCE, NOTHING_VARIES
from scipy.signal import lfilter

from crash_estimator.benchmarks.second_judge import judge, right
from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.diagnosis.observation.rest import rests_of
from crash_estimator.core.diagnosis.observation.whitening import filtered, weights
from crash_estimator.core.diagnosis.report.tolerance import DEFAULT
from crash_estimator.core.diagnosis.report.verdict import verdict_on
from crash_estimator.core.noise_spectrum import NoiseSpectrum
from crash_estimator.core.sensor_noise import sensor_noise
from crash_estimator.model_file import ModelFile
from crash_replay.conditioning import cfc_filter
from crash_replay.recording import Channel, Recording, Test
from crash_replay.second_generator.cases import case_of, drawn
from crash_replay.second_generator.sensors import RATE, Sensors
from crash_replay.second_generator.structures import G

NOTHING_HIDDEN = (
    "cab/nothing/1g/coloured/71100276", "sled/nothing/0.5g/cfc180/71100144",
    "side/nothing/0.5g/masses/71100013", "cab/nothing/0.5g/drifting/71100195", "side/nothing/1g/1khz/71100008",
)  # fmt: skip
"""And one that rings, below."""
HIDDEN = (
    "side/path.linear/2g/cfc180/71100095", "cab/channel.gain/0.5g/coloured/71100039",
    "wall/rate.log/2g/ringing/71100048",
)  # fmt: skip


@pytest.mark.parametrize("name", NOTHING_HIDDEN)
def test_a_right_model_is_adequate_with_sensors_as_they_are(name):
    assert judge(case_of(name))["verdict"] == "adequate"


@pytest.mark.parametrize("name", HIDDEN)
def test_what_is_missing_is_named_with_sensors_as_they_are(name):
    assert right(judge(case_of(name)))


@pytest.mark.parametrize("name", ["sled/channel.delay/1g/clean/71400029"])
def test_what_a_coarse_curve_leaves_is_no_mimic(name):
    """It is white, and goes along with a force that varies with time, until the curve is finer."""
    assert right(judge(case_of(name)))


def test_a_zero_that_drifts_is_named_with_its_form():
    it = drawn(case_of("sled/channel.drift/1g/clean/71400066"))
    found = diagnose(ModelFile.model_validate(yaml.safe_load(it.model_text)).structure(), it.recordings)
    assert found.verdict == "effect_missing" and "channel_offset (drift) on sled_ax" in found.text
    assert [step["form"] for step in found.as_json()["steps"]] == ["drift"]
    assert found.structure.effects[-1].variant == "drift"


def test_a_right_model_is_adequate_beside_what_rings_and_that_is_told():
    it = drawn(case_of("cab/nothing/2g/ringing/71100243"))
    structure = ModelFile.model_validate(yaml.safe_load(it.model_text)).structure()
    assert re.search(
        r"adequate: .*; what rings above 240 Hz, 1\.\d+ g, is left out$", diagnose(structure, it.recordings).text
    )


def test_the_noise_of_a_right_model_is_known_where_one_rest_is_too_short_for_it(monkeypatch):
    """Behind a pole at 170 Hz, as the noise of an AR(1) of 0.9 at 10 kHz is."""
    pole = np.exp(-2.0 * np.pi * 170.0 / RATE)

    def slow(self, name, signal, time, corner, end, rng):
        noise = lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], rng.standard_normal(len(signal)))
        return signal + self.noise * G * noise

    monkeypatch.setattr(Sensors, "_noisy", slow)
    assert judge(case_of("side/nothing/1g/clean/71100008"))["verdict"] == "adequate"


def test_only_recordings_that_are_sampled_alike_say_something_of_each_others_noise():
    rng, channels = np.random.default_rng(1), (Channel("a", "acceleration", "car"),)

    def recording(period_ns, colour):
        time_ns = np.arange(-300, 100) * period_ns
        return Recording(
            Test("one", channels), time_ns, lfilter([1.0], [1.0, -colour], rng.standard_normal((400, 1)), axis=0)
        )

    slow, other, white = recording(100_000, 0.8), recording(100_000, 0.8), recording(200_000, 0.0)
    colours = [rest.colours["a"] for rest in rests_of([slow, other, white])]
    assert [[len(one.coefficients) > 0 for one in each] for each in colours] == [
        [True, True],
        [True, True],
        [False, False],
    ]
    assert [[one.samples for one in each] for each in colours] == [[600, 600], [600, 600], [300, 300]]


def test_coloured_noise_is_white_once_it_is_weighted():
    n, period, pole = 4000, 1e-4, 0.8
    rng = np.random.default_rng(2)
    noise = np.zeros(n)
    for k, e in enumerate(rng.standard_normal(n - 1), start=1):
        noise[k] = pole * noise[k - 1] + e
    spectrum = NoiseSpectrum(1.0 / (1.0 - pole), np.inf, period, (-pole,))  # S(0) of s = 1
    white = filtered(noise[:, None] / spectrum.std, weights([spectrum], np.inf, n, period))[:, 0]
    correlation = np.corrcoef(white[1:], white[:-1])[0, 1]
    assert np.std(white) == pytest.approx(1.0, abs=0.05) and abs(correlation) < 0.05
    assert np.corrcoef(noise[1:], noise[:-1])[0, 1] > 0.7


def test_nothing_above_the_band_is_compared():
    n, period = 1000, 1e-3
    time = np.arange(n) * period
    both = np.sin(2.0 * np.pi * 20.0 * time) + np.sin(2.0 * np.pi * 300.0 * time)
    white = NoiseSpectrum(1.0, np.inf, period)
    left = filtered(both[:, None], weights([white], 100.0, n, period))[:, 0]
    assert np.abs(left - np.sin(2.0 * np.pi * 20.0 * time))[20:-20].max() < 0.1


@pytest.mark.parametrize("rests", [False, True])
def test_means_over_any_number_of_samples_of_a_channel_louder_in_the_crash_are_as_white(rests):
    """Its noise, that of what is fast in it, was of unknown period: at whole Hz a rounding took the place of 1."""
    time_ns = np.arange(-400, 3600) * 100_000
    louder = np.where(time_ns < 0, 1.0, 3.0) * np.random.default_rng(6).standard_normal(len(time_ns))
    density = sensor_noise(louder, time_ns, rests).density(np.arange(800.0), means_over=6)
    np.testing.assert_allclose(density, 1.0)


@pytest.mark.parametrize("rate", [1000.0, 10_000.0])
def test_without_a_rest_the_noise_is_that_beside_the_motion_of_the_crash(rate):
    """A push of 300 m/s^2 with white noise of 2 m/s^2, sampled slowly or fast."""
    time_ns = (np.arange(int(0.15 * rate)) / rate * 1e9).astype(np.int64)
    motion = 300.0 * np.sin(np.pi * time_ns * 1e-9 / 0.15) ** 2
    found = [
        sensor_noise(motion + np.random.default_rng(k).normal(0.0, 2.0, len(time_ns)), time_ns, rests=False).std
        for k in range(20)
    ]
    assert np.median(found) == pytest.approx(2.0, rel=0.15)


@pytest.mark.parametrize(("kept", "assumed"), [(20, True), (400, False)])
def test_behind_a_filter_that_a_rest_is_too_short_for_the_noise_is_taken_for_a_share_of_the_peak(kept, assumed):
    """Taken for its fast part, as it was, the floor was a ten-millionth of the noise.

    White noise of 2 m/s^2 at 10 kHz, behind CFC 60; so many samples of rest.
    """
    time_ns = np.arange(-400, 1000) * 100_000
    pulse = 300.0 * np.sin(np.pi * np.clip(time_ns * 1e-9 / 0.06, 0.0, 1.0)) ** 2
    values = cfc_filter(pulse + np.random.default_rng(5).normal(0.0, 2.0, len(time_ns)), 1e-4, 60)[400 - kept :]
    found = sensor_noise(values, time_ns[400 - kept :], rests=True)
    assert found.assumed == assumed and found.corner == pytest.approx(2.0775 * 60)
    assert found.std == pytest.approx(9.0 if assumed else 2.0, rel=0.3)


def test_a_channel_that_no_filter_has_passed_is_as_loud_as_its_fast_part():
    values = np.random.default_rng(5).normal(0.0, 2.0, 1000) + 300.0 * np.sin(np.arange(1000) / 300.0)
    found = sensor_noise(values, np.arange(-10, 990) * 100_000, rests=True)
    assert not found.assumed and found.white and found.std == pytest.approx(2.0, rel=0.1)


@pytest.mark.parametrize(("kept", "said"), [(20, True), (400, False)])
def test_that_it_is_assumed_is_said(kept, said):
    case = drawn(case_of("side/path.linear/1g/clean/71100095"))
    structure = ModelFile.model_validate(yaml.safe_load(case.model_text)).structure()

    def behind_a_filter(recording: Recording) -> Recording:
        values = np.apply_along_axis(cfc_filter, 0, recording.values, recording.sample_period, 180)
        late = recording.time_ns > -kept * recording.sample_period * 1e9
        return Recording(recording.test, recording.time_ns[late], values[late])

    found = diagnose(structure, list(map(behind_a_filter, case.recordings)))
    assert ("too little is recorded at rest to tell the noise behind a filter" in found.text) == said, found.text


@pytest.mark.parametrize(("assumed", "of_peak", "word"), [
    (False, 0.02, "adequate"), (True, 0.005, "adequate"), (True, 0.02, "unexplained"),
])  # fmt: skip
def test_a_model_is_not_adequate_for_leaving_less_than_a_noise_that_is_assumed(assumed, of_peak, word):
    left = SimpleNamespace(of_peak=of_peak, is_less_than_noise=True, astray=[])
    only_noise = EVIDENCE._replace(white=True, drift=NOTHING_VARIES, before=left, after=left)
    evidence = only_noise._replace(added=0, ranking=(), assumed=assumed)
    assert verdict_on(evidence, DEFAULT).word == word
