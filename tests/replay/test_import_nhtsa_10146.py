"""NHTSA test 10146 as it is imported: its motion, its peaks, its names and its traps."""

import numpy as np
import pytest
from helpers_paths import DATA
from numpy.testing import assert_allclose, assert_array_equal

from crash_replay.bag import read_bag, write_bag
from crash_replay.conditioning import cfc_filter, integrate, remove_offset
from crash_replay.readers import read_source

G = 9.80665
NHTSA = DATA / "nhtsa-10146"
BODY = ["left_rear_crossmember_ax", "right_rear_crossmember_ax"]
BODY += [f"{name}_redundant" for name in BODY]
real_data = pytest.mark.skipif(not NHTSA.is_dir(), reason=f"no recordings in {DATA}")


@pytest.fixture(scope="module")
def camry():
    return read_source(NHTSA)


def at(recording, time):
    return int(np.searchsorted(recording.time_ns, round(time * 1e9)))


@real_data
@pytest.mark.parametrize("prepare", [lambda r: r, remove_offset], ids=["as recorded", "offset removed"])
def test_body_motion(camry, prepare):
    """Integrated from 57.09 km/h at time zero, unfiltered; the offset (0.01 g) makes 0.07 % of difference."""
    recording = prepare(camry)
    single = [3.6 * integrate(recording.time, recording.column(name))[0][at(recording, 0.150)] for name in BODY]
    assert_allclose([min(single), max(single)], [-66.1, -64.5], atol=0.05)  # km/h
    assert_allclose(np.mean(single), -65.4, rtol=0.005)
    mean = np.mean([recording.column(name) for name in BODY], axis=0)
    v, x = integrate(recording.time, mean, recording.test.initial_velocity["car"])
    stop = int(np.argmax(v < 0))
    fraction = v[stop - 1] / (v[stop - 1] - v[stop])
    assert_allclose(recording.time[stop - 1] + fraction * recording.sample_period, 0.0735, atol=0.0005)
    assert_allclose(x.max(), 0.741, rtol=0.01)


@real_data
def test_filtered_peaks(camry):
    def filtered(values):
        return cfc_filter(values, camry.sample_period, 60)

    body = filtered(np.mean([camry.column(name) for name in BODY], axis=0)) / G
    assert_allclose(body.min(), -41.7, rtol=0.01)
    assert_allclose(camry.time[body.argmin()], 0.064, atol=0.0005)
    engine = filtered(camry.column("engine_top_ax")) / G
    assert_allclose(engine.min(), -106.9, rtol=0.01)
    assert_allclose(camry.time[engine.argmin()], 0.029, atol=0.0005)
    barrier = camry.column("barrier_fx")
    assert_allclose(barrier.max(), 731e3, rtol=0.001)
    assert_allclose(filtered(barrier).max(), 678e3, rtol=0.01)
    assert_allclose(camry.time[filtered(barrier).argmax()], 0.035, atol=0.0005)


@real_data
def test_names_bodies_and_means(camry):
    bodies = {channel.name: channel.body for channel in camry.test.channels}
    assert {name for name, body in bodies.items() if body == "car"} == {"car_ax", *BODY}
    assert {name for name, body in bodies.items() if body == "engine"} == {
        "engine_ax",
        "engine_top_ax",
        "engine_bottom_ax",
    }
    for name in ("driver_head_ax", "driver_head_ay", "driver_head_az", "driver_chest_ax", "driver_pelvis_ax"):
        assert bodies[name] == name.removesuffix(name[-3:])
    assert len(bodies) == 16
    assert_allclose(camry.column("car_ax"), np.mean([camry.column(name) for name in BODY], axis=0))
    assert_array_equal(camry.column("engine_ax"), camry.column("engine_top_ax"))
    assert set(camry.test.initial_velocity) == {"car", "engine", "driver_head", "driver_chest", "driver_pelvis"}
    assert_allclose(list(camry.test.initial_velocity.values()), 57.09 / 3.6)


@real_data
def test_traps(camry):
    assert len(camry) == 3500 and (camry.time_ns[0], camry.time_ns[-1]) == (-50_000_000, 299_900_000)
    bottom = camry.column("engine_bottom_ax")
    assert np.isfinite(bottom[:1170]).all() and np.isnan(bottom[1170:]).all()
    assert [c.name for c, v in zip(camry.test.channels, camry.values.T) if not np.isfinite(v).all()] == [
        "engine_bottom_ax"
    ]
    notes = "\n".join(camry.test.notes)
    assert "sum of 174 of 176 cells, without BARRIER F-01 Fx (curve 347), BARRIER C-04 Fx (curve 500);" in notes
    assert "positive in compression: sign turned" in notes
    assert "engine_bottom_ax: valid from -0.0500 s to 0.0669 s only, NaN elsewhere" in notes
    assert "no data file: curves 4-12, 16-19, 21-44, 47-90, 97-98, 101-106 and 348 barrier cell moments" in notes
    assert "sensor not fitted: curves 45-46, 91-92" in notes
    assert "closing speed 57.09 km/h, test mass 1719 kg" in notes
    assert max(map(len, camry.test.notes)) < 300


@real_data
def test_cells_are_kept_when_asked_for_and_add_up(camry):
    with_cells = read_source(NHTSA, cells=True)
    cells = [k for k, c in enumerate(with_cells.test.channels) if c.body == "barrier" and c.name != "barrier_fx"]
    assert len(cells) == 174 and with_cells.test.channels[cells[0]].name == "barrier_k01_fx"
    assert_allclose(with_cells.values[:, cells].sum(axis=1), camry.column("barrier_fx"), atol=1e-6)


@real_data
def test_bag_of_it_is_the_same(camry, tmp_path):
    read = read_bag(write_bag(camry, tmp_path / "camry"))
    assert_array_equal(read.values, camry.values)
    assert_array_equal(read.time_ns, camry.time_ns)
    assert read.test.channels == camry.test.channels and read.test.notes == camry.test.notes
    assert read.test.initial_velocity == camry.test.initial_velocity
