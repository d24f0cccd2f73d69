"""Recorded hardware with a known spring: the stiffness that is found is the one that was programmed."""

import re
from pathlib import Path

import pytest
from helpers_paths import DATA

from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.model_file import load_model

FOLDER = DATA / "cyberdiver"
pytestmark = pytest.mark.skipif(not FOLDER.exists(), reason="the CyberDiver recordings are not here")


def programmed(path: Path) -> float:
    """N/m from the file's name."""
    return float(re.search(r"__(\d+)npmm_", path.name)[1]) * 1e3


FILES = sorted(FOLDER.glob("linear_undamped__*.csv"))


@pytest.mark.parametrize("method", ["constrained_kalman", "kalman"])
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_the_programmed_stiffness_is_found(path, method):
    """Within 10 %."""
    from crash_replay.readers import read_source

    recording = read_source(path)
    estimator = make_estimator(load_model("impactor_single"), recording.test, method)
    last = run(estimator, (sample for sample in recording.samples() if sample.time < 0.04))[-1]
    assert last.parameters[0] == pytest.approx(programmed(path), rel=0.10)
