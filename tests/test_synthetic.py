"""The simulator of test recordings: its mechanics, its sensors, its scenarios and the bundled bags."""

from dataclasses import replace
from functools import cache
from math import tanh
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from ruamel.yaml import YAML
from scipy.constants import g as G
from scipy.integrate import quad
from scipy.interpolate import PchipInterpolator

from crash_estimator.model_file import load_model
from crash_replay.bag import read_bag, write_bag
from crash_replay.recording import Channel
from crash_replay.synthesize_command import main
from crash_replay.synthetic.curves import Curve, constant, stepped
from crash_replay.synthetic.forces import Spring
from crash_replay.synthetic.integrate import simulate
from crash_replay.synthetic.recordings import BUILDERS, SCENARIOS
from crash_replay.synthetic.scenario import record
from crash_replay.synthetic.sensors import Sensor, accelerometer, read
from crash_replay.synthetic.system import Body, Element, Motion, System
from crash_replay.synthetic.truth_file import truth_text

BAGS = Path(__file__).parents[1] / "bags"
STIFFENING = Curve((0.0, 0.02, 0.05, 0.1), (1.0e5, 1.2e5, 2.0e5, 2.4e5))

ideal = cache(lambda name: SCENARIOS[name](ideal=True))
bundled = cache(lambda name: SCENARIOS[name]())


def oscillator(spring: Spring, damping: float = 0.0, velocity: float = 2.0) -> System:
    """10 kg against a wall."""
    return System(
        (Body("block", 10.0, velocity), Body("wall")), (Element("spring", ("block", "wall"), spring, damping),)
    )


# --- force laws


def test_curve_is_scipys_pchip_and_constant_beyond_its_ends():
    x = np.linspace(0.0, 0.1, 301)
    assert_allclose([STIFFENING(v) for v in x], PchipInterpolator(STIFFENING.x, STIFFENING.y)(x), rtol=1e-13)
    assert STIFFENING(-1.0) == 1.0e5 and STIFFENING(5.0) == 2.4e5


def test_stepped_curve_changes_within_its_width_and_nowhere_else():
    curve = stepped((0.0, 8.0), (0.1, 3.0), (0.2, 5.0), width=0.01)
    assert [curve(x) for x in (0.0, 0.05, 0.1, 0.11, 0.15, 0.2, 0.21, 9.0)] == [8.0, 8.0, 8.0, 3.0, 3.0, 3.0, 5.0, 5.0]
    assert_allclose(curve(0.105), 5.5)


def test_plastic_spring_unloads_on_its_line_and_reloads_on_it():
    spring = Spring(constant(1.0e5), unloading=5.0e5)
    assert_allclose(spring(0.10, 1.0, 0.10), 1.0e4)
    assert_allclose(spring(0.09, -1.0, 0.10), 5.0e3)
    assert_allclose(spring(0.09, +1.0, 0.10), 5.0e3)
    assert spring(0.079, -1.0, 0.10) == 0.0


def test_unloading_slope_below_the_stiffness_is_refused():
    with pytest.raises(ValueError, match="unloading slope must be at least the largest stiffness 240000 N/m"):
        Spring(STIFFENING, unloading=2.0e5)


@pytest.mark.parametrize("spring", [Spring(STIFFENING, tension=False), Spring(STIFFENING, unloading=6.0e5)])
def test_compression_only_springs_never_pull(spring):
    forces = [
        spring(x, v, max(peak, x)) for x in np.linspace(-0.2, 0.2, 81) for v in (-5.0, 5.0) for peak in (0.0, 0.07)
    ]
    assert min(forces) == 0.0 and max(forces) > 1e4


@pytest.mark.parametrize("seed", range(5))
def test_plastic_spring_gives_back_less_than_it_took(seed):
    """On any path of crush the work put in so far, the integral of F dX, is never negative; some is lost for good."""
    spring, rng = Spring(STIFFENING, unloading=6.0e5), np.random.default_rng(seed)
    turns = np.append(rng.uniform(-0.03, 0.09, 12), 0.0)
    path = np.concatenate([np.linspace(a, b, 400) for a, b in zip(turns, turns[1:])])
    peak = np.maximum.accumulate(np.maximum(path, 0.0))
    force = np.array([spring(x, 0.0, p) for x, p in zip(path, peak)])
    work = np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(path))
    start = quad(lambda x: spring(x, 0.0, x), 0.0, max(turns[0], 0.0))[0]
    assert (start + work).min() > -1e-3  # J; the trapezium rule's error at the corners
    assert start + work[-1] > 10.0


# --- integration


def test_runge_kutta_is_of_fourth_order():
    """A linear oscillator turns exactly by w t in the plane of w x and v: half the step, a sixteenth of the error."""
    time, w = np.array([0.0, 0.05]), np.sqrt(1.0e5 / 10.0)

    def error(step: float) -> float:
        end = simulate(oscillator(Spring(constant(1.0e5))), time, step)
        return np.hypot(
            w * end.displacement[-1, 0] - 2.0 * np.sin(w * 0.05), end.velocity[-1, 0] - 2.0 * np.cos(w * 0.05)
        )

    ratios = [error(step) / error(step / 2.0) for step in (2e-3, 1e-3, 5e-4)]
    assert_allclose(ratios, 16.0, rtol=0.05)
    assert error(1e-5) < 1e-11


def test_conservative_system_keeps_its_energy():
    """Kinetic and stored energy stay constant to 1e-6, through swings of a stiffening spring between two bodies."""
    spring = Spring(STIFFENING)
    system = System((Body("a", 10.0, 3.0), Body("b", 25.0)), (Element("spring", ("a", "b"), spring),))
    history = simulate(system, np.linspace(0.0, 0.2, 201))
    kinetic = 0.5 * (history.velocity**2 @ [10.0, 25.0])
    knots = list(STIFFENING.x[1:-1])
    stored = [
        quad(lambda x: spring(x, 0.0, 0.0), 0.0, abs(x), points=knots, epsrel=1e-10)[0] for x in history.crush[:, 0]
    ]
    assert max(stored) > 0.7 * kinetic[0]
    assert_allclose(kinetic + stored, 45.0, rtol=1e-6)


def test_damper_takes_what_the_motion_loses():
    history = simulate(oscillator(Spring(constant(1.0e5)), damping=200.0), np.linspace(0.0, 0.1, 10_001))
    energy = 5.0 * history.velocity[:, 0] ** 2 + 0.5e5 * history.crush[:, 0] ** 2
    lost = np.trapezoid(200.0 * history.rate[:, 0] ** 2, history.time)
    assert_allclose(energy[0] - energy[-1], lost, rtol=1e-5)
    assert (np.diff(energy) <= 1e-9).all()


def test_plastic_contact_rebounds_slower_than_it_came_and_leaves():
    """Of the energy only that under the unloading line comes back: v = v0 sqrt(K / Ku)."""
    history = simulate(oscillator(Spring(constant(1.0e5), unloading=9.0e5)), np.linspace(0.0, 0.06, 601))
    # the turn is taken at the end of a step of 10 us, at most 1e-4 rad past the peak; so is the separation
    assert_allclose(history.velocity[-1, 0], -2.0 / 3.0, rtol=1e-5)
    assert history.force[-1, 0] == 0.0 and history.force.min() == 0.0


def test_driven_body_moves_as_given_whatever_it_meets():
    motion = Motion((0.0, 0.01, 0.03), (0.0, 8.0, 5.0))
    system = System(
        (Body("door", displacement=-0.02, motion=motion), Body("rib", 16.8)),
        (Element("door_rib", ("door", "rib"), Spring(constant(1.0e5), tension=False)),),
    )
    history = simulate(system, np.linspace(0.0, 0.04, 401))
    at = history.velocity[[0, 100, 300, 400], 0]
    assert_allclose(at, [0.0, 8.0, 5.0, 5.0], atol=1e-9)
    travel = np.concatenate([[0.0], np.cumsum(0.5e-4 * (history.velocity[1:, 0] + history.velocity[:-1, 0]))])
    assert_allclose(history.displacement[:, 0], travel - 0.02, atol=1e-5)  # the trapezium rule's error
    assert history.velocity[-1, 1] > 1.0


def test_a_body_needs_a_mass_above_zero_and_a_driven_one_has_none():
    with pytest.raises(ValueError, match="body rib: the mass must be > 0 kg, got 0.0"):
        Body("rib", 0.0)
    with pytest.raises(ValueError, match="body door: a driven body has no mass"):
        Body("door", 80.0, motion=Motion((0.0, 1.0), (0.0, 0.0)))


@pytest.mark.parametrize("name", ["frontal_abrupt", "side_mdb_door_car", "side_dummy_unpadded"])
def test_the_step_is_fine_enough(name):
    """Half the step changes no acceleration by more than a third of an accelerometer's step of 0.03 g."""
    scenario = BUILDERS[name]()
    time = np.arange(0.0, scenario.duration, 5e-4)
    coarse, fine = simulate(scenario.system, time), simulate(scenario.system, time, 5e-6)
    assert_allclose(coarse.acceleration, fine.acceleration, atol=0.01 * G, rtol=0.0)


# --- sensors


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


# --- recordings


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


# --- files and the command


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


def synthesize(monkeypatch, *arguments: str) -> int:
    """The command's exit status."""
    monkeypatch.setattr("sys.argv", ["synthesize", *arguments])
    try:
        main()
    except SystemExit as ended:
        return ended.code
    return 0


def test_command_writes_a_bag_and_its_truth(tmp_path, monkeypatch, capsys):
    bag = tmp_path / "mine.mcap"
    assert synthesize(monkeypatch, "impactor_single", "--to", str(bag), "--seed", "3") == 0
    assert_array_equal(read_bag(bag).values, SCENARIOS["impactor_single"](3)[0].values)
    assert "seed: 3" in (tmp_path / "mine.truth.yaml").read_text()
    assert "1001 samples, 3 channels; truth in mine.truth.yaml" in capsys.readouterr().out


def test_command_keeps_what_is_there_unless_forced(tmp_path, monkeypatch, capsys):
    bag = tmp_path / "mine.mcap"
    arguments = "impactor_single", "--rate", "1000", "--to", str(bag)
    assert synthesize(monkeypatch, *arguments) == 0
    capsys.readouterr()
    assert synthesize(monkeypatch, *arguments, "--noise", "2") == 1
    said = capsys.readouterr()
    assert said.out == "" and said.err.count("\n") == 1 and "exists already" in said.err and "--force" in said.err
    assert synthesize(monkeypatch, *arguments, "--noise", "2", "--force") == 0
    assert_array_equal(read_bag(bag).values, SCENARIOS["impactor_single"](rate=1000.0, noise=2.0)[0].values)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["frontal_singel", "--to", "x.mcap"], "invalid choice: 'frontal_singel'"),
        (["frontal_single"], "the argument --to is required"),
        (
            ["frontal_single", "--to", "x.mcap", "--noise", "-1"],
            "argument --noise: expected a number of 0 or more, got '-1'",
        ),
        (
            ["frontal_single", "--to", "x.mcap", "--seed", "one"],
            "argument --seed: expected a whole number of 0 or more",
        ),
        ([], "one of the arguments SCENARIO --all --list is required"),
    ],
)
def test_command_refuses_wrong_usage(arguments, complaint, monkeypatch, capsys):
    assert synthesize(monkeypatch, *arguments) == 2
    assert complaint in capsys.readouterr().err


def test_command_lists_every_scenario(monkeypatch, capsys):
    assert synthesize(monkeypatch, "--list") == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == list(SCENARIOS)
