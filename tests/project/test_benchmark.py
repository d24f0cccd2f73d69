"""`make benchmark`: the references do the same work as ours, and the whole of it runs; never how fast anything is."""

import os
import subprocess
import sys
import tempfile

import numpy as np
import pytest
from helpers_domain import own_domain
from numpy.testing import assert_allclose

from crash_estimator.benchmarks.speed_growth import growth
from crash_estimator.benchmarks.speed_page import renewed_page, whole_page
from crash_estimator.benchmarks.speed_recordings import chain, ringing
from crash_estimator.benchmarks.speed_reference import Compiled, Problem, filterpy_step, regressions
from crash_estimator.benchmarks.speed_row import Row
from crash_estimator.benchmarks.speed_start import BEGINNINGS, commands
from crash_estimator.benchmarks.speed_steps import MRLS, filtered
from crash_estimator.core.compiled.kalman import kalman_update
from crash_estimator.core.methods import make_estimator
from crash_estimator.model_file import load_model


@pytest.fixture(scope="module")
def problem(tmp_path_factory) -> Problem:
    model = chain(3, tmp_path_factory.mktemp("model") / "chain.yaml")
    return regressions(load_model(str(model)), ringing(3, 0.05))


@pytest.fixture(scope="module")
def compiled(tmp_path_factory) -> Compiled:
    made = Compiled.make(tmp_path_factory.mktemp("library"))
    if made is None:
        pytest.skip("there is no g++")
    return made


def test_the_compiled_filter_finds_what_ours_finds(problem, compiled):
    assert len(problem.psi) > 300
    assert_allclose(compiled.constrained_kalman(problem), filtered(problem), rtol=1e-6)


def test_the_compiled_mrls_rewinds_as_ours(problem, compiled):
    """Without rewinds it is weighted least squares with forgetting; with them it is not."""
    settings = MRLS | {"rewinds": 0}
    theta, information, pull = problem.initial, np.diag(problem.std**-2.0), np.zeros(0)
    pull = information @ theta
    for psi, y in zip(problem.psi, problem.target):
        information = MRLS["forgetting"] * information + psi.T / problem.noise @ psi
        pull = MRLS["forgetting"] * pull + psi.T / problem.noise @ y
    expected = np.linalg.solve(information, pull)
    assert_allclose(compiled.mrls(problem, *settings.values()), expected, rtol=1e-4)
    assert not np.allclose(compiled.mrls(problem, *MRLS.values()), expected, rtol=1e-4)


def test_filterpy_makes_the_same_step(problem):
    pytest.importorskip("filterpy")
    k = len(problem.psi) // 2
    step = filterpy_step(problem, k)
    step()
    kalman = step.__closure__[step.__code__.co_freevars.index("kalman")].cell_contents
    theta, factors = problem.initial.copy(), np.diag(problem.std**2)
    factors += np.diag(problem.walk[k] * np.maximum(np.abs(theta), 0.05 * problem.scale) ** 2)
    bounds, sample = np.full(len(theta), np.inf), (problem.psi[k], problem.target[k], problem.active[k])
    gain = np.zeros((len(theta), len(problem.noise)))
    kalman_update(theta, factors, problem.noise, *sample, -bounds, bounds, True, np.zeros(len(theta)), gain)
    assert kalman.x.shape == (len(theta), 1)  # a flat z would have made it a square
    assert_allclose(kalman.x[:, 0], theta, rtol=1e-6)


def test_the_chain_has_the_sizes_that_the_relay_is_told(tmp_path):
    from crash_estimator.benchmarks.speed_live import BODIES, SIZES

    description = make_estimator(
        load_model(str(chain(BODIES, tmp_path / "chain.yaml"))), ringing(BODIES, 0.02).test, "mrls"
    ).description
    assert SIZES == {
        "parameters": len(description.parameters),
        "residuals": len(description.equations),
        "forces": len(description.elements),
        "bodies": len(description.bodies),
    }


def test_growth_says_how_it_grows(tmp_path):
    rows = list(growth(tmp_path, seconds=(0.3, 0.6), parameters=(2, 4)))
    assert len(rows) == 5 and all("grows as n^" in row.reference for row in rows[:3])
    assert "KiB" in rows[-1].ours and rows[-1].ratio == pytest.approx(1.0, abs=0.1)


def test_every_command_is_started_and_ends_by_itself(tmp_path):
    """With `--help` well; else where its work would begin, of which `synthesize` does the little there is."""
    assert set(BEGINNINGS) == set(commands())
    for name, module in commands().items():
        done = subprocess.run([sys.executable, "-m", module, *BEGINNINGS[name]], cwd=tmp_path, capture_output=True)
        assert done.returncode == (0 if name == "synthesize" else 1), f"{name}: {done.stderr}"


def test_a_row_says_whether_its_reach_is_held():
    assert Row("a", "1", "2", 0.9, 0.8).held == "yes" and Row("a", "1", "2", 0.7, 0.8).held == "no"
    assert Row("a", "1", "2", 1.6, 1.5, least=False).held == "no" and Row("a", "1", "2", 0.5).held == ""


def test_rows_that_are_measured_again_take_their_place_in_the_page():
    rows = [Row("a", "1 us", "2 us", 0.5, 1.0), Row("b", "3 us")]
    page = "\n".join(whole_page(rows, load=0.1))
    again = "\n".join(renewed_page(page, [Row("b", "4 us"), Row("c", "5 us")], load=2.5))
    table = [line for line in again.splitlines() if line.startswith("|")]
    firsts = [line.split(" | ")[:2] for line in table[2:]]
    assert firsts == [["| a", "1 us"], ["| b", "4 us"], ["| c", "5 us"]]
    assert again.startswith(page[: page.index("| b")])
    assert "load 2.5 before it began: *b*; *c*." in again


def test_the_command_runs(tmp_path):
    """The rows that need the graph, as short as may be; the others are run above."""
    command = [sys.executable, "-m", "crash_estimator.benchmarks.speed", "--quick", "--to", str(tmp_path), "--only"]
    with tempfile.TemporaryDirectory() as home:
        environment = os.environ | {"ROS_LOG_DIR": home, "ROS_DOMAIN_ID": str(own_domain())}
        parts = ("latency", "named", "real_time")
        done = subprocess.run([*command, *parts], capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    rows = done.stdout.splitlines()[2:]
    assert len(rows) == 5 and "bare relay" in rows[0] and " 0 lost" in rows[4], done.stdout
    assert "a block of one" in rows[2] and "to blocks alone" in rows[3]
    assert " inf " not in done.stdout and " nan " not in done.stdout, "some samples had no answer"
    assert not list(tmp_path.iterdir())  # some of the rows make no page
