"""Effects put into a model and taken out again, by hand and by file; what can be wrong with them; a user's own."""

import json

import pytest
from helpers_effects import drawn, hidden, last_of, parameter_of, place_of, with_it
from helpers_estimation import oscillator, oscillator_recording
from numpy.testing import assert_allclose
from ruamel.yaml import YAML

from crash_estimator.cli import estimate, report, simulate
from crash_estimator.cli.work.diagnose import _entry
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.base import ElementForce
from crash_estimator.core.effects.change import add_effect, remove_effect
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.structure import ModelError
from crash_estimator.model_file import load_model
from crash_replay.bag import write_bag
from crash_replay.synthetic.hidden.vocabulary import VOCABULARY


@pytest.mark.parametrize("effect", VOCABULARY)
def test_added_and_removed_it_is_the_model_as_before(effect):
    place = place_of(effect)
    model, what, recording, more = hidden(effect, place)
    first = add_effect(model, "constant_force", model.bodies[0].name) if effect != "constant_force" else model
    there = add_effect(first, effect, what.target, EFFECTS, recording.test, what.coefficient, what.shape, **more)
    assert there.effects[-1].type == effect and there != first
    assert remove_effect(there, effect, what.target) == first
    assert first.effects == there.effects[:-1]
    with pytest.raises(ModelError, match=f"effect {effect} acts on {what.target} already"):
        add_effect(there, effect, what.target, EFFECTS, recording.test)


@pytest.mark.parametrize(
    "change, line",
    [
        (lambda m: add_effect(m, "coulomb_frction", "spring"), "no effect 'coulomb_frction'; did you mean 'coulomb_fr"),
        (lambda m: add_effect(m, "coulomb_friction", "sprng"), "cannot act on 'sprng'; .*did you mean 'spring'"),
        (lambda m: add_effect(m, "added_mass", "wall"), "needs a free body: there are block"),
        (lambda m: add_effect(m, "channel_gain", "nothing_like_it"), "needs a channel: there are block_ax"),
        (lambda m: add_effect(m, "coulomb_friction", "spring", shape={"sped": 1.0}), "constant 'sped'; it has speed"),
        (lambda m: add_effect(m, "coulomb_friction", "spring", coefficient=-1.0), "must be not below 0 N, got -1"),
        (lambda m: remove_effect(m, "added_mass", "block"), "added_mass on block to remove; its effects: none"),
    ],
)
def test_a_mistake_is_one_line_that_says_what_there_is(change, line):
    with pytest.raises(ModelError, match=line) as error:
        change(oscillator())
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "effect, target, wants",
    [
        ("clearance", "spring", "coefficient, in m"),
        ("channel_delay", "block_ax", "coefficient, in s"),
        ("bottoming_out", "spring", "stop, in m"),
    ],
)
@pytest.mark.parametrize("method", ["rls", "constrained_kalman", "afmm"])
def test_what_no_equation_is_linear_in_must_be_given(method, effect, target, wants):
    model, test = add_effect(oscillator(), effect, target), oscillator_recording(n=10).test
    with pytest.raises(ModelError, match=f"{effect} on {target} needs its {wants}.*diagnose --apply"):
        make_estimator(model, test, method)


def test_ones_own_effect_is_estimated_like_ours():
    recording = oscillator_recording(damping=0.0, noise=0.3)
    own = {"cubic_damping": ElementForce("cubic_damping", "N*s^3/m^3", force=lambda motion: motion.rate**3)}
    effects = EFFECTS | own
    model = add_effect(oscillator(), "cubic_damping", "spring", effects)
    found = last_of(model, recording, effects=effects)
    value, std, _ = found["spring.cubic_damping"]
    assert abs(value) < 3.0 * std  # there is none of it in the recording
    with pytest.raises(ModelError, match="there is no effect 'cubic_damping'"):
        make_estimator(model, recording.test, "rls")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("effects")


def command(monkeypatch, module, *arguments) -> int:
    monkeypatch.setattr("sys.argv", [module.__name__, *map(str, arguments)])
    with pytest.raises(SystemExit) as exit_:
        module.main()
    return exit_.value.code


@pytest.mark.parametrize("effect", VOCABULARY)
def test_what_a_diagnosis_writes_is_estimated(monkeypatch, capsys, folder, effect):
    place = place_of(effect)
    _, what, recording, _ = hidden(effect, place)
    spec = with_it(effect, place, what.coefficient).effects[-1]
    content = dict(drawn(effect, place).specimen.model)
    content = {**content, "effects": [dict(_entry(spec, EFFECTS[effect], list(content["bodies"])))]}
    model, bag = folder / f"{effect}.yaml", folder / f"{effect}.mcap"
    with model.open("w") as file:
        YAML(typ="safe").dump(content, file)
    (read,) = load_model(model).effects
    assert (read.type, read.target, read.host, read.touches) == (spec.type, spec.target, spec.host, spec.touches)
    assert_allclose(read.coefficient, spec.coefficient, rtol=1e-5)  # six digits are written
    write_bag(recording, bag)
    assert command(monkeypatch, estimate, bag, "--model", model) == 0
    printed = capsys.readouterr().out
    told = [f"{spec.coefficient:.4g}", "known"]
    if parameter_of(effect, what.target) in printed:
        (row,) = [line.split() for line in printed.splitlines() if line.startswith(parameter_of(effect, what.target))]
        told = ["known"]
    else:
        (row,) = [line.split() for line in printed.splitlines() if line.startswith(effect)]
        assert what.target in row
    assert set(told) <= set(row)


def test_a_small_coefficient_is_printed_with_its_digits(monkeypatch, capsys, folder):
    _, what, recording, _ = hidden("channel_gain", "frontal")
    model, bag = folder / "gain.yaml", folder / "gain.mcap"
    content = dict(drawn("channel_gain", "frontal").specimen.model)
    with model.open("w") as file:
        YAML(typ="safe").dump({**content, "effects": [{"type": "channel_gain", "channel": what.target}]}, file)
    write_bag(recording, bag)
    assert command(monkeypatch, estimate, bag, "--model", model) == 0
    printed = capsys.readouterr().out.splitlines()
    (row,) = [line.split() for line in printed if line.startswith(f"{what.target}.channel_gain")]
    value, sigma = float(row[1]), float(row[2])
    assert 0.0 < sigma < 0.1 * abs(what.coefficient)
    assert abs(value - what.coefficient) < 3.0 * sigma


def test_simulate_and_report_honour_the_effect(monkeypatch, capsys, folder):
    model, bag = folder / "viscous_damping.yaml", folder / "viscous_damping.mcap"
    bare = folder / "bare.yaml"
    content = YAML(typ="safe").load(model.read_text())
    with bare.open("w") as file:
        YAML(typ="safe").dump({k: v for k, v in content.items() if k != "effects"}, file)
    assert command(monkeypatch, simulate, bag, "--model", bare, "--json", folder / "bare.json") == 0
    assert command(monkeypatch, simulate, bag, "--model", model, "--json", folder / "with.json") == 0
    errors = [
        json.loads((folder / f"{name}.json").read_text())["comparisons"]["engine"]["rms"] for name in ("bare", "with")
    ]
    assert errors[1] < 0.5 * errors[0]
    assert command(monkeypatch, report, bag, "--model", model, "--to", folder / "page") == 0
    assert "viscous_damping" in (folder / "page" / "report.html").read_text()
