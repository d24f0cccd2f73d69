"""The benchmark on recordings made elsewhere: which it knows, what it holds for right. One is run where they are."""

import sys
from types import SimpleNamespace

import pytest
from helpers_paths import DATA

from crash_estimator.benchmarks import outside


def found(verdict: str, *steps: tuple[str, str, float]) -> SimpleNamespace:
    named = [SimpleNamespace(effect=effect, target=target, coefficient=value) for effect, target, value in steps]
    return SimpleNamespace(verdict=verdict, steps=named)


def test_what_is_true_stands_in_a_recording_s_name(tmp_path):
    folder = tmp_path / "cyberdiver"
    folder.mkdir()
    for name in ("damped__15npmm_6mps_05damping", "undamped__45npmm_3mps"):
        (folder / f"linear_{name}_trial1.csv").touch()
    (tmp_path / "nhtsa-10146").mkdir()
    damped, undamped, *car = outside.cases(tmp_path)
    assert (damped.name, damped.truth) == ("impactor, 15 N/mm, 6 m/s, damped", "a damper of 46.8 N s/m")
    assert (undamped.name, undamped.truth) == ("impactor, 45 N/mm, 3 m/s, undamped", "no damper")
    assert [case.name for case in car] == ["NHTSA 10146", "NHTSA 10146, CFC 60"]
    damper = ("viscous_damping", "spring", 44.0)
    assert damped.right(found("effect_missing", damper)) and not damped.right(found("unexplained", damper))
    assert not damped.right(found("effect_missing", ("viscous_damping", "spring", 41.0)))
    assert not damped.right(found("effect_missing", ("coulomb_friction", "spring", 44.0)))
    assert undamped.right(found("unexplained", damper)) and not undamped.right(found("effect_missing", damper))
    engine = ("unmodelled_body", "engine_ax", 310.0)
    assert car[0].right(found("effect_missing", ("plastic_unloading", "car_barrier", 1e7), engine))
    assert not car[0].right(found("effect_missing", ("unmodelled_body", "engine_ax", 520.0)))
    assert not car[0].right(found("effect_missing", ("unmodelled_body", "driver_chest_ax", 400.0)))


def test_a_folder_without_any_of_them_is_one_clear_error(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(sys, "argv", ["outside", "--data", str(tmp_path), "--to", str(tmp_path / "page.md")])
    with pytest.raises(SystemExit) as ended:
        outside.main()
    assert ended.value.code != 0 and "folders cyberdiver, nhtsa-10146" in capsys.readouterr().err
    assert not (tmp_path / "page.md").exists()


@pytest.mark.skipif(not (DATA / "cyberdiver").exists(), reason="needs the recordings in ../shared/data")
def test_a_real_damper_is_named_and_its_rivals_with_it():
    case = next(
        case for case in outside.cases(DATA) if case.name == "impactor, 15 N/mm, 2 m/s, damped" and "23.4" in case.truth
    )
    name, truth, told, _, _, right, _ = outside.judged(case)
    assert told.startswith("`effect_missing`: viscous_damping on spring ") and right == "yes", (name, truth, told)
    assert "(or quadratic_damping on spring" in told
    assert "coulomb_friction" not in told, "friction that rises up to the largest rate is that damper"
