"""The simulator's sensors, and what its seeds and options change."""

from dataclasses import replace

import numpy as np
from helpers_synthetic import ideal
from numpy.testing import assert_allclose, assert_array_equal
from scipy.constants import g as G

from crash_replay.recording import Channel
from crash_replay.synthetic.recordings import BUILDERS, SCENARIOS
from crash_replay.synthetic.scenario import record
from crash_replay.synthetic.sensors import Sensor, accelerometer, read


def test_noise_is_white_normal_and_as_large_as_stated():
    n = 20_000
    reading = read(accelerometer("a_x", "a"), np.zeros(n), np.random.default_rng(3))
    noise = (reading.values - reading.offset) / G
    assert_allclose(noise.std(), 1.0, atol=4.0 / np.sqrt(2 * n))  # four standard errors
    assert_allclose(noise.mean(), 0.0, atol=4.0 / np.sqrt(n))
    assert abs(np.mean(noise[1:] * noise[:-1])) < 4.0 / np.sqrt(n)
    assert_allclose(np.mean(np.abs(noise) < 1.96), 0.95, atol=0.01)
    assert 0.0 < abs(reading.offset) <= 0.5 * G


def test_noise_as_a_share_of_the_signal():
    signal = 30.0 * np.sin(np.linspace(0.0, 20.0, 1001))
    sensor = Sensor(Channel("a_x", "acceleration"), "a", noise_share=0.37)
    assert_allclose(read(sensor, signal, np.random.default_rng(0)).noise, 0.37 * signal.std())


def test_values_are_whole_steps_within_the_full_scale():
    sensor = replace(accelerometer("a_x", "a"), full_scale=30.0 * G)
    reading = read(sensor, np.linspace(-50.0 * G, 50.0 * G, 2001), np.random.default_rng(0))
    steps = reading.values / (0.03 * G)
    assert_allclose(steps, np.rint(steps), atol=1e-9)
    assert_allclose([reading.values.min(), reading.values.max()], [-30.0 * G, 30.0 * G])
    assert np.count_nonzero(reading.values == reading.values.max()) > 300


def test_ideal_sensors_record_the_signal():
    recording, truth = ideal("side_dummy_padded")
    for name, channel in truth.channels.items():
        assert_array_equal(recording.column(name), channel.signal)
        assert channel.noise == channel.offset == 0.0


def test_same_seed_same_bits_and_another_seed_other_noise():
    first, again, other = (SCENARIOS["frontal_single"](seed)[0] for seed in (7, 7, 8))
    assert_array_equal(first.values, again.values)
    assert (first.values != other.values).mean() > 0.9
    assert_array_equal(first.time_ns, other.time_ns)


def test_one_more_sensor_leaves_the_others_as_they_were():
    scenario = BUILDERS["side_mdb_door_car"]()
    fewer = replace(scenario, sensors=scenario.sensors[:2])
    assert_array_equal(record(fewer, 5)[0].values, record(scenario, 5)[0].values[:, :2])


def test_options_change_what_they_name():
    base, _ = ideal("frontal_single")
    slower, truth = SCENARIOS["frontal_single"](rate=1000.0, speed=0.5, noise=2.0)
    assert_array_equal(slower.time_ns, base.time_ns[::10])
    assert slower.test.initial_velocity == {"car": 13.3 / 2}
    assert truth.channels["car_ax"].noise == 2.0 * G and truth.channels["barrier_fx"].noise == 3000.0
    sparse, _ = SCENARIOS["frontal_single"](rate=1000.0, ideal=True)
    assert_allclose(sparse.values, base.values[::10], rtol=1e-9, atol=1e-9)  # the truth does not depend on the sampling
