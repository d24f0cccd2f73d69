"""`demo`: the show from end to end without a screen, what it leaves behind, and how it takes what goes wrong."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from helpers_demo import BAG, demo, rows, view_origins  # noqa: F401  the fixture demo
from helpers_paths import ROOT
from helpers_viewer import rows as temporal_rows

from crash_estimator.core.errors import equation_errors
from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.model_file import load_model
from crash_estimator.tables import error_table, parameter_table
from crash_replay.bag import read_bag
from crash_replay.recording import Recording

ESTIMATORS = ("mrls", "constrained_kalman")
PLAIN = ("--no-diagnosis", "--recording", str(BAG), "--model", "frontal_engine_cab")
STOPPED = 8.0
"""s: longer than the 5 s after which the middleware forgets a process that says nothing."""
FAST, SLOW = (*PLAIN, "--rate", "0.1"), (*PLAIN, "--rate", "0.02")


@pytest.fixture(scope="module")
def recording():
    return read_bag(BAG)


def test_the_whole_show_without_a_screen(demo, recording):  # noqa: F811
    """Of a viewer that was stopped for a while, too; one that was not is in the README's demonstration."""
    show = demo(*PLAIN, "--rate", "0.05")
    show.wait_for_samples()
    show.stop("/viewer ", STOPPED)
    assert show.ended_complete(), show.said()
    assert not show.left_over()
    assert len(show.children) >= 4, "viewer, two estimators and replay; what draws the picture comes later"
    said = show.said()
    total = len(recording)
    assert re.search(rf"140\.0 ms  █+  {total}/{total} samples  0\.\d+ x real time  0 lost\n", said), said
    assert f"replay finished: {total} samples sent in {total} messages" in said
    _tables_are_those_of_the_loop(said, recording)
    assert f"rerun {show.folder}/demo.rrd\n" in said and "What to look at, by tab:" in said
    _every_view_has_data(show.folder / "demo.rrd", total)
    temporal = temporal_rows(show.folder / "demo.rrd")
    assert all(temporal[f"/signal/cab/model/{name}"] == total for name in ESTIMATORS)
    _curves_can_be_seen(show.folder / "demo.png", said)


def _tables_are_those_of_the_loop(said: str, recording: Recording) -> None:
    """What came over the graph gives them to the last digit."""
    for method in ESTIMATORS:
        estimator = make_estimator(load_model("frontal_engine_cab"), recording.test, method)
        estimates = run(estimator, recording.samples())
        assert f"{method}: model frontal_engine_cab, method {method}, {len(recording)} samples, 0 lost" in said
        assert parameter_table(estimator.description, estimates) in said
        assert error_table(equation_errors(estimator.description, estimates)) in said


def _every_view_has_data(rrd: Path, total: int) -> None:
    counts, origins = rows(rrd), view_origins(rrd)
    kinds = {origin.split("/")[1] for origin in origins}
    assert kinds == {
        "signal",
        "residual",
        "innovation",
        "parameter",
        "force_crush",
        "motion",
        "state",
        "event",
        "summary",
        "free_run",
        "validation",
    }
    assert {f"/signal/{name}" for name in ("cab", "engine", "barrier")} <= origins
    for origin in origins:
        inside = {path: n for path, n in counts.items() if path == origin or path.startswith(f"{origin}/")}
        assert inside, f"view of {origin} is empty"
        if origin in ("/summary", "/state") or origin.startswith("/validation/"):
            continue
        for name in ESTIMATORS:
            own = [n for path, n in inside.items() if name in path.split("/")]
            assert own, f"{name} is not in the view of {origin}"
            if origin.split("/")[1] in ("signal", "residual", "innovation", "parameter"):
                assert max(own) >= total, f"{origin}: {own} rows of {name}"


def _curves_can_be_seen(png: Path, said: str) -> None:
    """The curves' own colours in its picture, of the first tab: measured in the plots, both estimators as well."""
    from PIL import Image

    from crash_estimator.viewer.colors import ESTIMATOR_COLORS, MEASURED

    if "incomplete: no picture: " in said:
        pytest.skip(f"no picture can be drawn here: {said.splitlines()[-1]}")
    picture = np.asarray(Image.open(png).convert("RGB")).astype(int)
    assert picture.shape == (900, 1600, 3)
    upper, lower = picture[:300], picture[500:]  # accelerations; motion and force over crush
    # the least that a curve of 1.5 pixels across a third of the picture leaves, drawn over by the others here and there
    for part, color, least in (
        (upper, MEASURED, 500),
        (upper, ESTIMATOR_COLORS[0], 300),
        (upper, ESTIMATOR_COLORS[1], 100),
    ):
        assert np.sum(np.abs(part - color).max(axis=2) < 30) > least, color
    for color in ESTIMATOR_COLORS[:2]:
        assert np.sum(np.abs(lower - color).max(axis=2) < 30) > 100, color


def test_ctrl_c_ends_everything_and_keeps_what_was_recorded(demo):  # noqa: F811
    show = demo(*SLOW)
    show.wait_for_samples()
    show.process.send_signal(signal.SIGINT)
    assert show.end(20) == 130, show.said()
    assert not show.left_over()
    assert "Traceback" not in show.said()
    assert rows(show.folder / "demo.rrd"), "the recording can be read"


def test_nothing_is_left_where_the_demonstration_is_killed(demo):  # noqa: F811
    show = demo("--no-viewer", *SLOW)
    show.wait_for_samples()
    assert len(show.children) == 3
    show.process.kill()
    show.process.wait()
    assert not show.left_over(patience=60.0)


def test_who_is_stopped_for_a_while_takes_nothing_away(demo, recording):  # noqa: F811
    """Replay, an estimator and the demonstration itself, one after the other: who has missed something asks for it.

    At a rate at which there is something to miss in each of the stops: 19 s are played, of which two take 16.
    """
    show = demo("--no-viewer", *PLAIN, "--rate", "0.01")
    show.wait_for_samples()
    for who in ("/replay ", "__node:=mrls"):
        show.stop(who, STOPPED)
    assert f" {len(recording)}/" not in show.said(), "it still plays"
    os.kill(show.process.pid, signal.SIGSTOP)
    time.sleep(STOPPED)
    os.kill(show.process.pid, signal.SIGCONT)
    assert show.end() == 0, show.said()
    _tables_are_those_of_the_loop(show.said(), recording)


@pytest.mark.parametrize("killed, shown", [("viewer", True), ("mrls", False), ("replay", True)])
def test_who_dies_is_named_in_the_last_line_and_the_others_go_on(demo, killed, shown):  # noqa: F811
    """Soon: a viewer is not given the time to draw what a dead replay will not send."""
    show = demo(*([] if shown else ["--no-viewer"]), *PLAIN, "--rate", "0.05")
    show.wait_for_samples()
    os.kill(show.child(f"__node:={killed}" if killed in ESTIMATORS else f"/{killed} "), signal.SIGKILL)
    assert show.end() == 1, show.said()
    assert not show.left_over()
    assert re.match(rf"incomplete: {killed} has ended too early: .*signal 9", show.last_line()), show.said()
    assert show.said().count("has ended too early") == 2, "as it happens, and in the last line"
    for name in set(ESTIMATORS) - {killed}:
        complete = f"{name}: model frontal_engine_cab, method {name}, 1901 samples, 0 lost"
        assert (complete in show.said()) == (killed != "replay")


def test_an_estimator_that_never_comes_ends_it_at_once(demo):  # noqa: F811
    show = demo("--no-viewer", *FAST)
    show.wait_until(lambda: any("__node:=mrls" in line for line in show.left_over()), "mrls has been started")
    os.kill(show.child("__node:=mrls"), signal.SIGKILL)
    assert show.end() == 1, show.said()
    assert not show.left_over()
    assert show.last_line() == "incomplete: mrls has ended too early: signal 9"
    assert " samples  " not in show.said(), "nothing was replayed"


@pytest.mark.parametrize(
    ("arguments", "status", "complaint"),
    [
        (["--recording", "nowhere.csv"], 1, "nowhere.csv: there is no such file or folder"),
        (["--model", "side_dumy"], 1, "did you mean 'side_dummy'"),
        (["--model", "frontal_single"], 1, "has no channel 'car_ax' (wanted by body car)"),
        (["--method", "krls"], 2, "invalid choice: 'krls'"),
        (["--rate", "0"], 2, "must be between 0.001 and 1000 times real time"),
    ],
)
def test_what_cannot_be_shown_is_one_line(arguments, status, complaint, tmp_path):
    command = [sys.executable, "-m", "crash_estimator.demo.command", "--out", str(tmp_path), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, cwd=ROOT)
    assert done.returncode == status
    assert complaint in done.stderr
    if status == 1:
        assert done.stderr.count("\n") == 1 and done.stdout == ""
    assert not list(tmp_path.iterdir()), "nothing was started"
