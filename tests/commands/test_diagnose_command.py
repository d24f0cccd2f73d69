"""The command `diagnose`: what it prints and writes, a model with what was found, a user's effect, and clear errors."""

import json
import sys
from functools import cache

import pytest
import yaml

from crash_estimator.cli import diagnose, estimate
from crash_replay.bag import write_bag
from crash_replay.synthetic.hidden.cases import draw_case


def run(monkeypatch, command, *arguments):
    monkeypatch.setattr(sys, "argv", [command.__name__, *map(str, arguments)])
    with pytest.raises(SystemExit) as status:
        command.main()
    return status.value.code


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two bags of an impactor with a hidden damper, and a model file that does not tell of it."""
    there = tmp_path_factory.mktemp("hidden")
    drawn = draw_case("impactor", ["viscous_damping"], 3100)
    for name, speed in (("slow", 0.75), ("fast", 1.1)):
        write_bag(drawn.record(speed, 1.0)[0], there / f"{name}.mcap")
    (there / "model.yaml").write_text("# an impactor\n" + yaml.safe_dump(dict(drawn.specimen.model), sort_keys=False))
    return there


@cache
def damper() -> float:
    return draw_case("impactor", ["viscous_damping"], 3100).hidden[0].coefficient


def bags(folder):
    return folder / "slow.mcap", folder / "fast.mcap"


def test_it_says_what_is_missing_and_where_the_model_fails(monkeypatch, capsys, folder):
    out, new = folder / "found.json", folder / "new.yaml"
    model = folder / "model.yaml"
    assert run(monkeypatch, diagnose, *bags(folder), "--model", model, "--json", out, "--apply", new) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("effect missing: viscous_damping on padding; residual RMS")
    for word in ("where it fails, as given", "loading", "candidate", "+ viscous_damping on padding", "noise floor"):
        assert word in printed
    found = json.loads(out.read_text())
    assert found["verdict"] == "effect_missing"
    assert set(found["residual_rms"]) == {"before", "after", "noise_floor", "unit"}
    assert found["residual_rms"]["unit"] == "m/s^2"
    assert found["free_run_rms"]["after"] < found["free_run_rms"]["before"]
    first = found["ranking"][0]
    keys = "effect target coefficient std unit evidence explained identifiable confounded_with"
    assert set(keys.split()) <= set(first)
    assert (first["effect"], first["target"], first["unit"]) == ("viscous_damping", "padding", "N*s/m")
    assert abs(first["coefficient"] - damper()) < 4.0 * first["std"]
    assert 0.5 < first["explained"] <= 1.0 and first["identifiable"] and first["confounded_with"] == []
    std_of = lambda one: float("inf") if one["std"] is None else one["std"]  # noqa: E731
    unsure = [one for one in found["ranking"] if not std_of(one) <= abs(one["coefficient"])]
    assert not any(one["identifiable"] for one in unsure), "whose sigma exceeds it may as well be nothing"
    evidence = [one["evidence"] for one in found["ranking"]]
    assert evidence == sorted(evidence, reverse=True)
    assert [(step["effect"], step["target"]) for step in found["steps"]] == [("viscous_damping", "padding")]
    assert found["steps"][0]["residual_rms"]["before"] > found["steps"][0]["residual_rms"]["after"]
    window = found["misfit"][0]
    assert {"start", "end", "body", "state", "rms"} <= set(window) and window["body"] == "impactor"
    assert window["state"] in ("loading", "unloading", "apart") and window["start"] < window["end"]


def test_the_model_with_the_effect_is_estimated_and_found_adequate(monkeypatch, capsys, folder):
    new = folder / "new.yaml"
    if not new.exists():
        assert run(monkeypatch, diagnose, *bags(folder), "--model", folder / "model.yaml", "--apply", new) == 0
    assert new.read_text().startswith("# an impactor\n"), "comments stay"
    (effect,) = yaml.safe_load(new.read_text())["effects"]
    assert (effect["type"], effect["element"]) == ("viscous_damping", "padding")
    assert effect["coefficient"] == pytest.approx(damper(), rel=0.05)
    assert run(monkeypatch, diagnose, *bags(folder), "--model", new) == 0
    assert "adequate: nothing significant is missing" in capsys.readouterr().out
    assert run(monkeypatch, estimate, bags(folder)[1], "--model", new) == 0
    assert "padding" in capsys.readouterr().out


OWN = """
from crash_estimator.core.effects.base import ElementForce

EFFECT = ElementForce("drag", "N*s^3/m^3", force=lambda motion: motion.rate**3)
"""


def test_a_user_s_effect_is_ranked_like_ours(monkeypatch, capsys, folder):
    own, out = folder / "my_effect.py", folder / "own.json"
    own.write_text(OWN)
    arguments = (*bags(folder), "--model", folder / "model.yaml", "--effects", own, "--json", out)
    assert run(monkeypatch, diagnose, *arguments) == 0
    ranking = json.loads(out.read_text())["ranking"]
    assert ranking[0]["effect"] == "viscous_damping"
    drag = next(one for one in ranking if one["effect"] == "drag")
    assert drag["unit"] == "N*s^3/m^3" and 0.0 < drag["evidence"] < ranking[0]["evidence"]


def edited(folder, old, new):
    path = folder / "mistaken.yaml"
    path.write_text((folder / "model.yaml").read_text().replace(old, new))
    return path


def test_what_is_at_fault_is_one_clear_line(monkeypatch, capsys, folder):
    slow, model = folder / "slow.mcap", folder / "model.yaml"
    effects = model.read_text() + "effects:\n- {type: viscous_dampin, element: padding}\n"
    (folder / "typo.yaml").write_text(effects)
    faults = {
        (slow, "--model", folder / "typo.yaml"): "no effect 'viscous_dampin'; did you mean 'viscous_damping'?",
        (slow, "--model", edited(folder, "impactor_ax", "impactor_az")): "impactor_az",
        (folder / "none.mcap", "--model", model): "none.mcap",
        (slow, "--model", model, "--effects", folder / "none.py"): "none.py",
    }
    for arguments, expected in faults.items():
        assert run(monkeypatch, diagnose, *arguments) == 1
        said = capsys.readouterr().err
        assert said.startswith("error: ") and said.count("\n") == 1 and expected in said


def test_without_a_model_the_usage_is_shown(monkeypatch, capsys, folder):
    assert run(monkeypatch, diagnose, folder / "slow.mcap") == 2
    assert "--model" in capsys.readouterr().err
