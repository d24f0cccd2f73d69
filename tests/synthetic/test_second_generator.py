"""The second generator: its sensors, its cases, and that it is on its own."""

from math import pi, sqrt

import numpy as np
import pytest
from helpers_modules import modules_after
from helpers_paths import PACKAGES
from numpy.testing import assert_allclose, assert_array_equal

from crash_replay.second_generator import cases
from crash_replay.second_generator.cases import NOTHING, SEEN, Case, CaseError, case_of, drawn
from crash_replay.second_generator.forms import FORMS, wrong_channel
from crash_replay.second_generator.plan import COUNTS, DEVELOPMENT, SEEDS, kind_of, plan
from crash_replay.second_generator.sensors import Sensors, cfc
from crash_replay.second_generator.structures import STRUCTURES, G

SEED = DEVELOPMENT + 700_000
"""First of the seeds that are drawn here."""


# --- sensors


def test_cfc_180_passes_what_it_must():
    """SAE J211-1: -3 dB (of both passes) at 1.65 times the class, 300 Hz; flat below 180 Hz within 1 dB."""
    time = np.arange(20000) / 1e4
    gain = [np.std(cfc(np.sin(2.0 * pi * f * time), 180.0)[5000:15000]) * sqrt(2.0) for f in (50.0, 180.0, 300.0)]
    assert_allclose(gain[0], 1.0, atol=0.01)
    assert 10 ** (-1.0 / 20.0) < gain[1] and 10 ** (-4.0 / 20.0) < gain[2] < 10 ** (-2.0 / 20.0)


def test_channels_are_wrong_within_what_may_be_asked():
    for seed in range(50):
        rng = np.random.default_rng(seed)
        assert abs(wrong_channel("offset", rng).size) < 5.0 and 0.9 < wrong_channel("gain", rng).size < 1.1
        assert wrong_channel("delay", rng).size < 1e-3
        assert sqrt(2.0) / (2.0 * pi * wrong_channel("lowpass", rng).size) < 1e-3
        assert 0.9 < np.cos(np.radians(wrong_channel("misaligned", rng).size)) < 0.97


# --- cases


def test_a_name_is_its_case():
    assert all(case_of(case.name) == case for case in plan())
    with pytest.raises(CaseError, match="name is written like side/friction.lugre/1g/clean/1, got 'x'"):
        case_of("x")
    for wrong in ("x/friction.lugre/1g/clean/1", "side/x/1g/clean/1", "side/nothing/1g/x/1"):
        with pytest.raises(CaseError):
            case_of(wrong)


def test_the_plan_asks_for_every_form_in_300_cases_with_a_seed_each():
    cases = plan()
    assert len(cases) == sum(COUNTS.values()) == 300
    assert {case.seed for case in cases} == set(range(SEEDS, SEEDS + 300)) and SEEDS + 300 <= DEVELOPMENT
    kinds = [kind_of(case) for case in cases]
    assert {kind: kinds.count(kind) for kind in COUNTS} == COUNTS
    for name, form in FORMS.items():
        asked = [case for case in cases if case.form == name and case.nuisance == "clean"]
        assert len(asked) >= 4 and {case.structure for case in asked} == set(form.targets)


@pytest.mark.parametrize("name", [
    "side/friction.stick/1g/clean", "wall/gap.one/0.5g/ringing", "sled/nothing/2g/coloured", "wall/nothing/1g/shifted",
    "sled/channel.delay/1g/clipped", "wall/nothing/1g/1khz",
])  # fmt: skip
def test_a_case_is_the_same_again_by_its_name(name):
    one, again = (drawn(case_of(f"{name}/{SEED}")) for _ in range(2))
    assert one.model_text == again.model_text and one.right == again.right
    for a, b in zip(one.recordings, again.recordings):
        assert_array_equal(a.values, b.values)
        assert_array_equal(a.time_ns, b.time_ns)


def test_another_seed_is_another_case():
    one, other = (drawn(case_of(f"wall/gap.one/1g/clean/{SEED + n}")) for n in (0, 1))
    assert other.model_text != one.model_text


def test_what_is_hidden_changes_the_recording_by_more_than_the_noise(monkeypatch):
    """At the nominal speed alone: what shows there shows in two recordings."""
    monkeypatch.setattr(cases, "SPEEDS", (1.0,))
    monkeypatch.setattr(Sensors, "record", lambda *given: [])  # only how large it is
    for n, (name, form) in enumerate(FORMS.items()):
        if name == "body.engine":  # it changes the model, not the recording
            continue
        quickest = next(one for one in ("wall", "sled", "side", "cab") if one in form.targets)
        case = Case(quickest, name, 1.0, "clean", SEED + 100 + n)
        assert drawn(case).seen > SEEN, case.name


def test_what_is_hidden_is_not_in_the_model_and_what_is_right_is_written_down():
    case = Case("cab", "mass.rigid", 1.0, "clean", SEED)
    it = drawn(case)
    (right,) = it.right
    assert right[0] == "added_mass" and right[1] in ("cab", "engine")
    assert drawn(Case("side", "outside.running", 1.0, "clean", SEED)).right == ()
    assert drawn(Case("cab", "body.engine", 1.0, "clean", SEED)).right == (("unmodelled_body", "engine_ax"),)


@pytest.mark.parametrize("structure", STRUCTURES)
def test_recordings_are_as_a_laboratory_makes_them(structure):
    it = drawn(Case(structure, NOTHING, 1.0, "clean", SEED))
    assert it.right == () and len(it.recordings) == 2
    for recording in it.recordings:
        quiet = recording.time_ns < 0
        for channel in recording.test.channels:
            values = recording.column(channel.name)
            if channel.quantity == "acceleration":
                assert_allclose(values[quiet].std(), G, rtol=0.2)  # 300 samples: 0.04, at five sigma
                assert 8.0 * G < np.abs(values).max() < 160.0 * G


def test_a_shifted_time_zero_is_a_shift_of_the_clock_alone():
    early_and_late = [drawn(Case("wall", NOTHING, 1.0, "shifted", SEED + n)).recordings for n in range(4)]
    shifts = [1e-9 * recording.time_ns[0] + 0.03 for both in early_and_late for recording in both]
    assert all(1e-3 <= abs(shift) <= 5e-3 for shift in shifts)
    assert min(shifts) < 0.0 < max(shifts)


def test_a_clipped_channel_ends_at_its_range():
    case = Case("wall", NOTHING, 1.0, "clipped", SEED)
    car = [recording.column("car_ax") for recording in drawn(case).recordings]
    most = max(np.abs(values).max() for values in car)
    assert sum(np.isclose(np.abs(values), most, atol=0.1).sum() for values in car) > 50


# --- on its own


def test_it_shares_nothing_with_what_it_judges_nor_with_the_first_simulator():
    loaded = modules_after("import crash_replay.second_generator.plan")
    assert "crash_replay.second_generator.machine" in loaded
    assert not [name for name in loaded if name.startswith(("crash_estimator", "crash_replay.synthetic"))]
    sources = (PACKAGES / "crash_replay" / "crash_replay" / "second_generator").glob("*.py")
    assert not [path.name for path in sources if "crash_estimator" in path.read_text()]
