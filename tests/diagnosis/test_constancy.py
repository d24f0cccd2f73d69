"""Whether what varies with time is seen in a residual that looks white, and only that."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from crash_estimator.core.diagnosis.observation.record import observe
from crash_estimator.core.diagnosis.parameterization.magnitudes import measure_magnitudes
from crash_estimator.core.diagnosis.report.diagnosis import diagnose
from crash_estimator.core.diagnosis.residuals.score_test import Drift, drift_of
from crash_estimator.core.diagnosis.selection.fitted_model import fit_model
from crash_estimator.core.structure import Structure
from crash_estimator.model_file import ModelFile, load_model
from crash_replay.recording import Recording
from crash_replay.second_generator.cases import case_of, drawn
from crash_replay.synthetic.hidden.cases import HiddenCase, draw_case
from crash_replay.synthetic.hidden.specimen import Specimen

DURATION = 0.1
"""s, about that of a simulated frontal impact."""


def drift(drawn: HiddenCase) -> Drift:
    """Of the model as given, fitted to recordings at two speeds."""
    structure = ModelFile.model_validate(dict(drawn.specimen.model)).structure()
    return drift_on(structure, [drawn.record(speed, 1.0)[0] for speed in (0.75, 1.1)])


def drift_on(structure: Structure, recordings: Sequence[Recording]) -> Drift:
    records = [observe(structure, recording) for recording in recordings]
    return drift_of(fit_model(measure_magnitudes(structure, records), records, ()).fit)


def test_a_right_model_is_constant():
    """The probability is that of the worst of several statistics, which go along with each other: no smaller than
    uniform. Of 12, three below 0.05 come once in 50 such tests."""
    found = [drift(draw_case(structure, (), 60100 + n)) for n in range(6) for structure in ("impactor", "single")]
    assert all(one.constant for one in found)
    assert sum(one.probability < 0.05 for one in found) < 3


def slowly(time: np.ndarray) -> np.ndarray:
    return np.cos(np.pi * np.clip(time / DURATION, 0.0, 1.0))


def heavier(specimen: Specimen, size: float) -> Specimen:
    return specimen.with_body("engine", growth=lambda time: 1.0 + size * slowly(time))


def pushed(specimen: Specimen, size: float) -> Specimen:
    force = size * 200.0 * specimen.body("engine").mass
    return specimen.with_body("engine", push=lambda time: force * slowly(time))


def amplified(specimen: Specimen, size: float) -> Specimen:
    return specimen.with_sensor("engine_ax", distortion=lambda time, signal: signal * (1.0 + size * slowly(time)))


@pytest.mark.parametrize(
    "hidden, size, what",
    [
        (heavier, 0.03, "the mass of engine"),
        (pushed, 0.03, "a force on engine"),
        (amplified, 0.03, "the gain of engine_ax"),
    ],
)
def test_what_varies_with_time_is_named(hidden, size, what):
    right = draw_case("frontal", (), 60200)
    assert drift(right).constant
    found = drift(replace(right, specimen=hidden(right.specimen, size)))
    assert not found.constant and found.what.split(" or ")[0] == what and found.share > 0.9


@pytest.mark.parametrize("structure, element", [("cab", "cab_barrier"), ("side", "rib_spine")])
def test_an_element_that_breaks_is_named(tmp_path: Path, structure, element):
    """By the second simulator, at some crush: what is left of its force varies with time more than all else does."""
    case = drawn(case_of(f"{structure}/outside.breaking/1g/clean/71000402"))
    (tmp_path / "a.model.yaml").write_text(case.model_text, encoding="utf-8")
    found = drift_on(load_model(tmp_path / "a.model.yaml"), case.recordings)
    assert case.target == element and not found.constant and found.what == f"the stiffness of {element}"


def test_two_effects_that_mimic_a_growing_mass_do_not_explain_it():
    """Rate hardening and an added mass leave a residual that is white in every band."""
    drawn = draw_case("impactor", ("changing_mass",), 700111)
    structure = ModelFile.model_validate(dict(drawn.specimen.model)).structure()
    found = diagnose(structure, [drawn.record(speed, 2.0)[0] for speed in (0.75, 1.1)])
    assert len(found.steps) == 2 and found.models[-1].white
    assert found.verdict == "unexplained"
    assert "the mass of impactor" in found.text and "varies with time" in found.text
