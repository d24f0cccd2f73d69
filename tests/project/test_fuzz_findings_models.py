"""Every kind of wrong message, model, setting and effect that once ended in a traceback or a hang: one line now."""

import sys

import numpy as np
import pytest
from crash_msgs import msg
from helpers_paths import ROOT
from helpers_refusals import BOMB, changed, refused

from crash_estimator.cli import diagnose
from crash_estimator.cli.common import parse_settings
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.base import ElementMotion
from crash_estimator.core.effects.user import load_effects
from crash_estimator.fuzz.valid import EFFECT, MODEL, OUTPUT, TEST_INFO, cdr
from crash_estimator.model_file import load_model
from crash_estimator.nodes.viewer_messages import parameter_block
from crash_replay.ros_messages import decoded, test_from_msg

# ---- messages


@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        ("samples", 10**12, "samples, more than"),
        ("samples", 2**63, "samples, more than"),
        ("sample_period", float("nan"), "sample_period must be"),
        ("sample_period", -1.0, "sample_period must be"),
        ("sample_period", 0.0, "sample_period must be"),
        ("initial_velocity", [float("nan")], "initial velocity of 'car' must be"),
        ("initial_velocity", [1.0, 2.0], "1 bodies, 2 velocities"),
        ("initial_displacement", [], "0 displacements"),
        ("bodies", ["car", "car"], "different bodies"),
        ("channels", [*TEST_INFO.channels, TEST_INFO.channels[0]], "appears more than once"),
        ("channels", [TEST_INFO.channels[0]] * 3000, "3000 channels"),
    ],
)
def test_a_test_that_cannot_be(field, value, said):
    message = decoded(cdr(TEST_INFO), msg.TestInfo)
    setattr(message, field, value)
    assert said in refused(test_from_msg, message)


def test_as_many_samples_as_may_be_take_no_memory_before_they_come():
    message = decoded(cdr(TEST_INFO), msg.TestInfo)
    message.samples = 9_000_000
    assert len(test_from_msg(message).channels) == 3


@pytest.mark.parametrize("raw", [b"", b"\x00\x01\x00\x00", b"\x00\x01\x00\x00" + b"\xff" * 100, bytes(range(256))])
def test_bytes_that_are_no_test(raw):
    assert "does not decode as TestInfo" in refused(decoded, raw, msg.TestInfo)


def test_an_output_whose_lengths_do_not_fit():
    message = decoded(cdr(OUTPUT["block/parameters"]), type(OUTPUT["block/parameters"]))
    message.value = [1.0]
    assert "value: expected 4 values" in refused(parameter_block, "mrls", message)


# ---- models, settings, effects


@pytest.mark.parametrize(
    "value", ["true", '"400"', "1e308", ".inf", ".nan", "0", "-1", "1" * 400, "[1]", "{a: 1}", "2001-01-01"]
)
@pytest.mark.parametrize("key", ["mass: 400.5", "std: 1.0e5", "noise: 2.0"])
def test_a_model_s_number_that_is_none(tmp_path, key, value):
    folder = changed(MODEL, tmp_path, "model.yaml", key, f"{key.partition(':')[0]}: {value}")
    if (key, value) in (("std: 1.0e5", "1" * 400),):
        value = "a number of 1326 bits"
    line = refused(load_model, folder / "model.yaml", EFFECTS)
    assert "model.yaml:" in line and key.partition(":")[0] in line


def test_a_bomb_in_a_mass(tmp_path):
    folder = changed(MODEL, tmp_path, "model.yaml", "name: two_mass", "name: two_mass\n" + BOMB)
    assert "parts, more than" in refused(load_model, folder / "model.yaml")


SEMANTIC = {
    "a body that is not there": ("[engine, barrier]", "[engin, barrier]", ":13: elements.engine_barrier.between: "),
    "a body without mass": ("mass: 400.5, ", "", ":4: bodies.engine: "),
    "a channel twice": ("[car_ax]", "[car_ax, car_ax]", ":3: bodies.car.acceleration: "),
    "an effect's target": ("element: car_engine", "element: car_engin", ":19: effects.0: "),
    "an effect": ("type: added_mass", "type: aded_mass", ":20: effects.1: "),
    "an effect twice": (
        "{type: added_mass, body: car}",
        "{type: coulomb_friction, element: car_engine}",
        ":20: effects.1: ",
    ),
    "a shape constant": ("speed: 0.1", "sped: 0.1", ":19: effects.0: "),
    "a coefficient": ("coefficient: 1810", "coefficient: -1", ":19: effects.0: "),
}


@pytest.mark.parametrize("mistake", SEMANTIC)
def test_what_a_model_means_wrongly_has_file_line_and_key(tmp_path, mistake):
    old, new, place = SEMANTIC[mistake]
    folder = changed(MODEL, tmp_path, "model.yaml", old, new)
    assert f"model.yaml{place}" in refused(load_model, folder / "model.yaml", EFFECTS)


def test_a_model_without_an_equation_has_file_line_and_key(tmp_path):
    text = (
        "name: x\nbodies:\n  a: {motion: a_ax}\n  b: {fixed: true}\nelements:\n  e: {between: [a, b], stiffness: 1}\n"
    )
    (tmp_path / "model.yaml").write_text(text)
    assert "model.yaml:2: bodies: model x: there is no equation" in refused(load_model, tmp_path / "model.yaml")


@pytest.mark.parametrize(
    "setting", ["m=" + "1" * 400, "forgetting=nan", "forgetting=inf", "forgetting", "=", "m=1e300000"]
)
def test_settings_that_are_no_number(setting):
    refused(parse_settings, [setting])


BODY = "return np.maximum(motion.crush, 0.0) * motion.rate / width"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("import sys", "import sys\nsys.exit(0)", "calls sys.exit"),
        ("import sys", "raise KeyboardError", "NameError"),
        (BODY, "sys.exit(0)", "force of 'position_damping' fails on a motion it was tried on: calls sys.exit"),
        (BODY, "return 'x'", "force of 'position_damping' fails"),
        (BODY, "return motion.crush[:3]", "must give one number for each"),
        (BODY, "return motion.crush * np.nan", "must be finite"),
        (BODY, "return 1e308", "must be finite"),
        ("force=force", "force=5", "force must be a function"),
        ("force=force", "force=force, low=5.0, high=1.0", "low < high"),
        ("(0.1, 0.5)", "()", "needs finite low and high"),
        ("(0.1, 0.5)", "(np.nan,)", "needs finite low and high"),
        ('"position_damping"', "5", "an effect's name is a word"),
        ('{"width": Shape("m", 0.01, 1.0, (0.1, 0.5))}', '{"width": 5}', "mapping of names to Shape"),
        ("size=100.0", "size=np.inf", "size"),
    ],
)
def test_an_effects_file_at_fault(tmp_path, old, new, said):
    folder = changed(EFFECT, tmp_path, "mine.py", old, new)
    line = refused(load_effects, folder / "mine.py")
    assert "mine.py" in line and said in line


@pytest.mark.parametrize(
    ("late", "said"), [("sys.exit(0)", "calls sys.exit"), ("1 / 0", "ZeroDivisionError"), ("'x'", "fails")]
)
def test_an_effect_that_fails_late_says_who_it_is(tmp_path, late, said):
    folder = changed(EFFECT, tmp_path, "mine.py", BODY, f"return {late} if len(motion.time) > 64 else motion.crush")
    effect = load_effects(folder / "mine.py")["position_damping"]
    motion = ElementMotion(*np.ones((5, 100)))
    line = refused(lambda: effect.force(motion, width=0.1))
    assert "mine.py: force of 'position_damping'" in line and said in line


def test_an_effect_that_ends_the_program_late_is_no_success(tmp_path, monkeypatch, capsys):
    """It once ended `diagnose` with status 0 and nothing printed."""
    folder = changed(EFFECT, tmp_path, "mine.py", BODY, "return sys.exit(0) if len(motion.time) > 64 else motion.crush")
    bag, model = "bags/frontal_single.mcap", "frontal_single"
    root = ROOT
    command = ["diagnose", str(root / bag), "--model", model, "--effects", str(folder / "mine.py")]
    monkeypatch.setattr(sys, "argv", command)
    with pytest.raises(SystemExit) as ended:
        diagnose.main()
    assert ended.value.code == 1 and "force of 'position_damping'" in capsys.readouterr().err
