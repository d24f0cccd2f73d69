"""Laws written in other forms than the first: found as such, written by `--apply`, and right when read back."""

from dataclasses import replace

import numpy as np
import pytest
import yaml
from crash_msgs.srv import AddEffect
from helpers_paths import ROOT

from crash_estimator.cli.work.diagnose import apply
from crash_estimator.core.diagnosis import Diagnosis, diagnose
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.structure import EffectSpec, ModelError, Structure
from crash_estimator.model_file import ModelFile, load_model
from crash_estimator.nodes.effect_requests import request_of, with_effect
from crash_estimator.ready_models import model_path
from crash_replay.bag import read_bag
from crash_replay.recording import RecordingError
from crash_replay.second_generator.cases import Drawn, case_of, drawn
from crash_replay.synthetic.hidden.cases import draw_case


def found_in(name: str) -> tuple[Drawn, Diagnosis]:
    """A development case of the second simulator, and what is said of it."""
    case = drawn(case_of(name))
    return case, diagnose(structure_of(case), case.recordings)


def structure_of(case: Drawn) -> Structure:
    return ModelFile.model_validate(yaml.safe_load(case.model_text)).structure()


def written(found: Diagnosis, model: str, folder) -> Structure:
    apply(found, (), EFFECTS, model, str(folder / "applied.yaml"))
    return load_model(folder / "applied.yaml", EFFECTS)


@pytest.mark.parametrize(
    ("name", "form", "contacts"),
    [
        ("side/gap.both/0.5g/clean/71700001", "play", "nothing"),
        ("side/force.rising/1g/clean/71700002", "rising", "nothing"),
        ("sled/cubic.inside/0.5g/clean/71700003", "in_curve", "nothing"),
        ("wall/cubic.beside/0.5g/clean/71700004", "", "springs"),
        ("side/damper.metered/1g/clean/71700005", "metered", "nothing"),
        ("cab/limit.plastic/1g/clean/34000268", "plastic", "nothing"),  # of a body that pushes on others as well
        ("side/limit.plastic/2g/clean/36000074", "plastic", "nothing"),  # whose usual fits end at a kink
        ("cab/limit.foam/0.5g/clean/72000000", "smooth", "nothing"),
    ],
)
def test_the_form_of_a_law_is_found_and_can_be_read_back(name, form, contacts, tmp_path):
    case, found = found_in(name)
    (step,) = found.steps
    assert found.verdict == "effect_missing" and found.complete
    assert ((step.effect, step.target), step.form) == (case.right[0], form)
    assert ("elastic forces that act on" in found.text) == (contacts == "springs")
    given = tmp_path / "given.yaml"
    given.write_text(case.model_text)
    structure = written(found, str(given), tmp_path)
    assert structure.effects[0].variant == form
    target = [e for e in structure.elements if e.name == step.target]
    assert all(element.acts_when_spent == contacts for element in target)
    again = diagnose(structure, case.recordings)
    assert again.verdict == "adequate" and "act on" not in again.text
    recording = case.recordings[0]  # and an estimator can follow it
    estimator = make_estimator(structure, recording.test, "rls")
    assert all(np.isfinite(estimate.parameters).all() for estimate in run(estimator, recording.samples()))


def test_a_law_that_another_one_imitates_is_named_beside_it():
    """A spring behind a dry slider that slips once is an unloading line: both leave noise, and both are said."""
    _, found = found_in("wall/hysteresis.slider/1g/clean/71000004")
    first = found.ranking[0]
    said = {first.effect, *(name.partition(" on ")[0] for name in first.confounded_with)}
    assert said == {"plastic_unloading", "hysteresis"}


@pytest.mark.parametrize("seed", [71500032, 71500033])  # of a usual leak, and of a slow one
def test_what_the_form_leaves_open_is_in_the_coefficients_sigma(seed):
    """A gas that keeps its heat and one that gives it to the walls leave as little, with coefficients that differ by a
    third: that of the usual form is told, and is not known better than that."""
    case = draw_case("single", ["gas_cushion"], seed)
    structure = ModelFile.model_validate(yaml.safe_load(case.model_text)).structure()
    found = diagnose(structure, [case.record(speed, 1.0, 10_000.0)[0] for speed in (0.75, 1.1)])
    (step,), (hidden,) = found.steps, case.hidden
    assert (step.effect, step.form) == ("gas_cushion", "")
    assert abs(step.coefficient - hidden.coefficient) < 2.0 * step.std
    assert step.std > 0.1 * step.coefficient > 2.0 * found.ranking[0].std


def test_contacts_that_leave_noise_to_three_effects_only_are_assumed_otherwise():
    """A damper that never pulls: rate hardening, friction and a wrong speed follow it, under another contact."""
    _, found = found_in("wall/damper.deepening/2g/clean/39000081")
    (step,) = found.steps
    assert (found.complete, step.effect, step.form) == (True, "viscous_damping", "hunt_crossley"), found.text


def test_dampers_that_pull_until_the_crush_is_gone_are_those_of_our_own_bag(tmp_path):
    """The simulator's dampers act both ways, and its springs unload along a line, of which the model file has none."""
    bag = read_bag(ROOT / "bags" / "frontal_single.mcap")
    found = diagnose(load_model("frontal_single"), [bag])
    (step,) = found.steps
    assert found.complete and (step.effect, step.target) == ("plastic_unloading", "car_barrier")
    assert "all forces that act on, dampers' too" in found.text
    structure = written(found, str(model_path("frontal_single")), tmp_path)
    assert structure.elements[0].acts_when_spent == "all"
    assert diagnose(structure, [bag]).verdict == "adequate"


def ready_with(folder, old: str, new: str) -> Structure:
    """The ready model frontal_single with other text in its file."""
    file, text = folder / "model.yaml", model_path("frontal_single").read_text()
    assert old in text
    file.write_text(text.replace(old, new))
    return load_model(file, EFFECTS)


def test_what_acts_where_a_spring_is_spent_is_one_of_three(tmp_path):
    with pytest.raises(RecordingError, match="acts_when_spent.*'nothing', 'springs' or 'all'"):
        ready_with(tmp_path, "tension: none", "tension: none\n    acts_when_spent: damper")


def test_a_shape_constant_of_another_form_is_one_clear_error(tmp_path):
    pushed = "effects:\n  - {type: constant_force, body: car, coefficient: 100.0, shape: {rise: 0.01}}\nelements:"
    with pytest.raises(ModelError, match="no shape constant 'rise'; it has none"):
        ready_with(tmp_path, "elements:", pushed)


CURVE, CONSTANT = "min: 0.0}   # N/m", "min: 0.0, shape: constant}   # N/m"
BENT = "effects:\n  - {type: yielding, element: car_barrier, form: plastic}\nelements:"


@pytest.mark.parametrize("stiffness", [CURVE, CONSTANT + "\n    unloading: 9.0e5"])
def test_what_stays_bent_has_one_stiffness_and_no_line(tmp_path, stiffness):
    file = tmp_path / "model.yaml"
    file.write_text(model_path("frontal_single").read_text().replace(CURVE, stiffness).replace("elements:", BENT))
    with pytest.raises(ModelError, match="yielding on car_barrier: form 'plastic' is of an element of one constant"):
        load_model(file, EFFECTS)
    file.write_text(model_path("frontal_single").read_text().replace(CURVE, CONSTANT).replace("elements:", BENT))
    assert load_model(file, EFFECTS).effects[0].variant == "plastic"


def test_a_request_to_a_running_estimator_names_the_form_as_a_model_file_does():
    model, pushed = load_model("frontal_single"), EffectSpec("constant_force", "car", 100.0, {"rise": 0.01})
    request = request_of(replace(pushed, variant="rising"))
    assert "form=rising" in request.options
    before = AddEffect.Request(
        effect=request.effect,
        target=request.target,
        options=[option.replace("form=", "variant=") for option in request.options],  # as older bags have it
    )
    for one in (request, before):
        assert with_effect(model, one).effects == (replace(pushed, variant="rising"),)
