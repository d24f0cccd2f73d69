"""The simulated recordings obey mechanics, look like crashes and fit their models; the bundled ones are made anew."""

from dataclasses import replace
from math import tanh

import numpy as np
import pytest
from helpers_paths import BAGS
from helpers_synthetic import bundled, ideal
from numpy.testing import assert_allclose, assert_array_equal
from ruamel.yaml import YAML
from scipy.constants import g as G

from crash_estimator.model_file import load_model
from crash_replay.bag import read_bag, write_bag
from crash_replay.synthetic.curves import Curve
from crash_replay.synthetic.recordings import BUILDERS, SCENARIOS
from crash_replay.synthetic.scenario import record
from crash_replay.synthetic.system import Element
from crash_replay.synthetic.truth_file import truth_text


@pytest.mark.parametrize("name", SCENARIOS)
def test_before_the_impact_there_is_only_offset_and_noise(name):
    recording, truth = ideal(name)
    before = recording.time_ns < 0
    expected = 0 if name.endswith("abrupt") else 500
    assert np.count_nonzero(before) == expected and recording.time_ns[expected] == 0
    assert not recording.values[before].any()
    assert all((element.force[before] == 0.0).all() for element in truth.elements.values())


@pytest.mark.parametrize("name", SCENARIOS)
def test_truth_obeys_newton_and_its_own_stiffness(name):
    recording, truth = ideal(name)
    system, after = truth.scenario.system, recording.time_ns >= 0
    for body in system.bodies:
        on_it = sum(
            (truth.elements[e.name].force * ((e.between[1] == body.name) - (e.between[0] == body.name)))
            for e in system.elements
        )
        assert_allclose(truth.bodies[body.name].load, on_it, atol=1e-6)
        if body.mass:
            assert_allclose(body.mass * truth.bodies[body.name].acceleration, on_it, atol=1e-6)
    for element in system.elements:
        found = truth.elements[element.name]
        loading = (found.state == "loading") & (np.abs(found.crush) > 1e-6)  # m: at no crush K is its limit
        assert loading.any()
        assert_allclose(found.spring_force[loading], (found.stiffness * found.crush)[loading], rtol=1e-9, atol=1e-6)
        told = after & (np.abs(found.crush) > 1e-6)  # m: at no crush the secant is its limit
        assert_allclose(found.secant[told] * found.crush[told], found.spring_force[told], atol=1e-6)
        assert (found.spring_force[found.state == "apart"] == 0.0).all()
        assert np.isnan(found.stiffness[found.state == "apart"]).all()
        assert_allclose(found.force - found.spring_force, np.where(after, element.damping * found.rate, 0.0), atol=1e-6)
        on_line = found.state == "unloading"
        if getattr(element.spring, "unloading", None) and on_line.any():
            back = found.stiffness * found.peak - element.spring.unloading * (found.peak - found.crush)
            assert_allclose(found.spring_force[on_line], back[on_line], rtol=1e-9, atol=1e-6)


def test_barrier_measures_what_stops_the_car():
    recording, _ = ideal("frontal_engine_cab")
    inertia = -1319.0 * recording.column("car_ax") - 400.0 * recording.column("engine_ax")
    assert_allclose(recording.column("barrier_fx"), inertia, atol=1e-6)
    assert recording.column("barrier_fx").max() > 4e5


@pytest.mark.parametrize("name", ["side_mdb_door_car", "side_abrupt"])
def test_side_impact_keeps_its_momentum(name):
    _, truth = ideal(name)
    momentum = sum(body.mass * truth.bodies[body.name].velocity for body in truth.scenario.system.bodies)
    assert_allclose(momentum, 14_000.0, rtol=1e-12)


@pytest.mark.parametrize("name", ["frontal_single", "frontal_engine_cab", "frontal_abrupt", "side_mdb_door_car"])
def test_the_bodies_never_gain_energy_beyond_the_first(name):
    _, truth = ideal(name)
    kinetic = sum(0.5 * b.mass * truth.bodies[b.name].velocity ** 2 for b in truth.scenario.system.bodies if b.mass)
    assert kinetic.max() <= kinetic[0] * (1.0 + 1e-12)
    assert kinetic[-1] < 0.75 * kinetic[0]  # crash structures absorb


PLAUSIBLE = {  # peak |acceleration| in g, and the velocity at the end in m/s, of a body
    "frontal_single": {"car": (15, 30, -3.0, -1.0)},
    "frontal_engine_cab": {"cab": (25, 45, -3.5, -1.0), "engine": (30, 80, -4.0, 1.0)},
    "frontal_abrupt": {"cab": (20, 45, -4.0, -1.0), "engine": (25, 80, -4.0, 1.0)},
    "side_mdb_door_car": {"mdb": (10, 30, 3.0, 5.6), "door": (60, 200, 4.0, 8.0), "car": (8, 25, 5.6, 7.5)},
    "side_dummy_unpadded": {"rib": (60, 120, 5.0, 16.0), "spine": (50, 90, 5.0, 16.0), "pelvis": (60, 130, 5.0, 12.0)},
    "side_dummy_padded": {"rib": (45, 100, 5.0, 16.0), "spine": (50, 90, 5.0, 16.0), "pelvis": (45, 110, 5.0, 12.0)},
    "impactor_single": {"body": (1, 4, 3.6, 3.9)},
}  # fmt: skip


@pytest.mark.parametrize("name", PLAUSIBLE)
def test_accelerations_and_rebound_are_those_of_a_crash(name):
    _, truth = ideal(name)
    for body, (low, high, slowest, fastest) in PLAUSIBLE[name].items():
        assert low < np.abs(truth.bodies[body].acceleration).max() / G < high
        assert slowest < truth.bodies[body].velocity[-1] < fastest


def test_padding_meets_the_dummy_earlier_and_loads_it_less():
    (recording, padded), (_, bare) = ideal("side_dummy_padded"), ideal("side_dummy_unpadded")
    for element in ("door_rib", "door_pelvis"):
        soft, hard = padded.elements[element], bare.elements[element]
        assert recording.time[np.argmax(soft.force > 0)] < recording.time[np.argmax(hard.force > 0)] - 0.004
        assert soft.force.max() < hard.force.max()
    for body in ("rib", "pelvis", "spine"):
        assert padded.bodies[body].acceleration.max() < bare.bodies[body].acceleration.max()


def test_an_effect_is_one_small_function():
    """Friction as one more law in an element: it dissipates, the recording changes, the rest is untouched."""
    scenario = BUILDERS["side_dummy_padded"]()

    def friction(crush: float, rate: float, peak: float) -> float:
        return 1000.0 * tanh(rate / 0.1) if crush > 0.0 else 0.0

    def with_friction(element: Element) -> Element:
        return replace(element, others=(friction,)) if element.name == "rib_spine" else element

    elements = tuple(map(with_friction, scenario.system.elements))
    _, truth = record(replace(scenario, system=replace(scenario.system, elements=elements)).ideal(), 1)
    found = truth.elements["rib_spine"]
    extra = found.force - found.spring_force
    assert (extra * found.rate >= 0.0).all()
    assert_allclose(np.abs(extra).max(), 1000.0, rtol=1e-3)


@pytest.mark.parametrize(
    ("name", "model"),
    [(n, n) for n in ("frontal_single", "frontal_engine_cab", "side_mdb_door_car", "impactor_single")]
    + [("side_abrupt", "side_mdb_door_car"), ("side_dummy_padded", "side_dummy"), ("side_dummy_unpadded", "side_dummy")]
    + [("frontal_abrupt", BAGS / "frontal_abrupt.model.yaml")],
)
def test_recording_fits_its_model(name, model):
    """Channels, elements, masses and known coefficients are those of the model that is run on the recording."""
    recording, truth = bundled(name)
    structure, system = load_model(model), truth.scenario.system
    structure.check_channels(recording.test)
    masses = {body.name: body.mass for body in system.bodies}
    assert all(masses[body.name] == body.mass for body in structure.bodies if body.free)
    elements = {element.name: element for element in system.elements}
    assert sorted(elements) == sorted(element.name for element in structure.elements)
    for element in structure.elements:
        true = elements[element.name]
        assert true.between == tuple(element.between)
        if not element.damping.estimated:
            assert true.damping == element.damping.value
        if not element.stiffness.estimated:
            assert set(true.spring.stiffness.y) == {element.stiffness.value}
        if element.unloading is not None:
            assert true.spring.unloading == element.unloading


@pytest.mark.parametrize("name", SCENARIOS)
def test_bundled_bag_is_made_anew_bit_for_bit(name, tmp_path):
    recording, truth = bundled(name)
    made, kept = write_bag(recording, tmp_path / f"{name}.mcap"), BAGS / f"{name}.mcap"
    assert made.read_bytes() == kept.read_bytes(), "run `make bags`, and say why they changed"
    assert kept.stat().st_size < 1_000_000
    assert (BAGS / f"{name}.truth.yaml").read_text() == truth_text(truth)


def test_bundled_bag_reads_back_as_recorded():
    recording, back = bundled("side_dummy_padded")[0], read_bag(BAGS / "side_dummy_padded.mcap")
    assert_array_equal(back.values, recording.values)
    assert_array_equal(back.time_ns, recording.time_ns)
    assert back.test.initial_displacement == recording.test.initial_displacement


def test_truth_file_says_what_was_simulated():
    _, truth = bundled("side_dummy_padded")
    content = YAML(typ="safe", pure=True).load(truth_text(truth))
    rib = content["elements"]["door_rib"]
    assert rib["unloading"] == 6.0e5 and rib["tension"] is False
    assert_allclose(rib["peak"]["force"], truth.elements["door_rib"].force.max(), rtol=1e-4)
    curve = Curve(rib["stiffness"]["crush"], rib["stiffness"]["value"])
    loading = truth.elements["door_rib"].state == "loading"
    found = truth.elements["door_rib"]
    assert_allclose([curve(x) for x in found.crush[loading]], found.stiffness[loading])
    assert content["bodies"]["rib"]["mass"] == 16.8
    assert_allclose(content["channels"]["rib_ay"]["offset"], truth.channels["rib_ay"].offset, rtol=1e-4)
