"""Every command takes every kind of recording; units suit the size; a contact that cannot pull never does."""

import sys
from importlib import import_module

import numpy as np
import pytest
from helpers_forms import FORMS, SPEED, every_form, short
from helpers_paths import BAGS
from numpy.testing import assert_allclose, assert_array_equal

from crash_estimator.cli import diagnose, estimate, report, simulate
from crash_estimator.cli.common import read_crash
from crash_estimator.core.characteristic import _as_it_can
from crash_estimator.demo.choice import as_bag
from crash_estimator.model_file import load_model
from crash_replay.import_command import main as import_main
from crash_replay.replay_node import ReplayNode
from crash_replay.shown_units import readable


@pytest.fixture
def forms(tmp_path, monkeypatch):
    return every_form(tmp_path, monkeypatch)


def run(monkeypatch, command, *arguments):
    monkeypatch.setattr(sys, "argv", [command.__name__, *map(str, arguments)])
    with pytest.raises(SystemExit) as status:
        command.main()
    return status.value.code


def test_all_forms_are_the_same_recording(forms, tmp_path):
    expected = short()
    for form in FORMS:
        recording = read_crash(forms[form])
        for name in ("car_ax", "barrier_fx"):
            column = expected.column(name)
            assert_allclose(recording.column(name), column, atol=1e-6 * np.abs(column).max(), err_msg=form)
        assert_array_equal(recording.time_ns, expected.time_ns, err_msg=form)
        assert_allclose(recording.test.initial_velocity["car"], SPEED, rtol=1e-6, err_msg=form)
        _, bag, _ = as_bag(type(tmp_path)(forms[form]), tmp_path / "out", 0)  # the demonstration's way
        assert_allclose(read_crash(str(bag)).column("car_ax"), recording.column("car_ax"))


def test_every_command_takes_every_form(forms, tmp_path, monkeypatch, capsys):
    """What is computed of them has its own tests: here it is only looked at what comes in."""
    came = []

    class Enough(Exception):
        pass

    def stop(*arguments, **_):
        came.extend(arguments)
        raise Enough

    for form in FORMS:
        for command, function, arguments in (
            (diagnose, "diagnose", [forms[form], "--model", "frontal_single"]),
            (estimate, "make_estimator", [forms[form], "--model", "frontal_single"]),
            (simulate, "make_estimator", [forms["csv"], "--model", "frontal_single", "--from", forms[form]]),
            (report, "write_report", [forms[form], "--model", "frontal_single", "--to", tmp_path / "report"]),
        ):
            came.clear()
            with monkeypatch.context() as patched:
                patched.setattr(import_module(command.__name__.replace(".cli.", ".cli.work.")), function, stop)
                assert run(patched, command, *arguments) == 1
            assert "Enough" in capsys.readouterr().err and came, (form, command.__name__)
        assert import_main([forms[form], "--to", str(tmp_path / "again.mcap"), "--force"]) == 0, form


def test_the_replay_takes_them_too(forms):
    import rclpy

    rclpy.init(args=["--ros-args", "-p", f"bag:={forms['csv']}"])
    try:
        node = ReplayNode()
        assert node.pacing.player.time_ns[-1] == short().time_ns[-1]
        node.destroy_node()
    finally:
        rclpy.shutdown()


@pytest.mark.parametrize(
    "unit, largest, shown",
    [("N", 640e3, "kN"), ("N", 12.0, "N"), ("m", 0.7, "mm"), ("m", 1.3, "m"), ("N/m", 1.5e4, "kN/m"), ("N/m", 50,
    "N/m"),
     ("kg", 3.0, "kg"), ("m/s^2", 300.0, "g")],
)  # fmt: skip
def test_units_suit_the_size(unit, largest, shown):
    assert readable(unit, [0.0, -largest, np.nan])[0] == shown


def test_a_small_rig_is_shown_in_newtons(monkeypatch, capsys):
    bag = BAGS / "impactor_single.mcap"
    assert run(monkeypatch, simulate, bag, "--model", "impactor_single", "--method", "rls") == 0
    said = capsys.readouterr().out
    head = next(line for line in said.splitlines() if line.startswith("force over crush of"))
    assert "largest N" in head and "kN " not in head
    crush = said.splitlines()[said.splitlines().index(head) + 2].split()[1]
    assert 0.1 < float(crush) < 1.0 and len(crush) >= 4, "less than a millimetre, and to its third digit"


def test_a_contact_never_pulls():
    """Noise about zero, and the other side of a straight line, come out as nothing for an element without tension."""
    elements = {element.name: element for element in load_model("side_dummy").elements}
    contact = next(element for element in elements.values() if not element.tension)
    assert_array_equal(_as_it_can(contact, np.array([-720.0, 0.0, 50.0])), [0.0, 0.0, 50.0])
    joined = next((element for element in elements.values() if element.tension), None)
    if joined is not None:
        assert_array_equal(_as_it_can(joined, np.array([-720.0, 50.0])), [-720.0, 50.0])
