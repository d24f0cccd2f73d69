"""The viewer's drawings and its recorder, without ROS: what is in the .rrd, what is on the picture, what goes wrong."""

import os
import signal
import socket
import subprocess
import time
from pathlib import Path

import helpers_viewer as crash_data
import numpy as np
import pytest
import rerun as rr
from numpy.testing import assert_allclose, assert_array_equal
from PIL import Image
from rerun.blueprint.api import Container, View
from rerun.chunk import RrdReader

from crash_estimator.viewer import cast as cast_module
from crash_estimator.viewer import layout
from crash_estimator.viewer.axes import axis_for, round_up, text
from crash_estimator.viewer.blocks import EventBlock, ForceBlock, ParameterBlock, ResidualBlock, join
from crash_estimator.viewer.cast import ESTIMATOR_COLORS, MEASURED, Cast, member
from crash_estimator.viewer.curves import BAND
from crash_estimator.viewer.frames import FRAMES, frame_ends
from crash_estimator.viewer.loops import HEIGHT, WIDTH
from crash_estimator.viewer.native import viewer_binary
from crash_estimator.viewer.plausible import PARAMETER, PREDICTION, Limits
from crash_estimator.viewer.recorder import Recorder
from crash_estimator.viewer.schematic import schematic
from crash_estimator.viewer.screenshot import ScreenshotError, main, screenshot
from crash_estimator.viewer.sinks import Sinks, usable_port
from crash_estimator.viewer.states import States
from crash_estimator.viewer.summary import with_std

G = 9.80665
NAMES = ("mrls", "ckf")


@pytest.fixture(scope="module", autouse=True)
def strict():
    rr.set_strict_mode(True)  # bad input raises instead of being warned of
    yield
    rr.set_strict_mode(False)


@pytest.fixture(scope="module")
def crash() -> crash_data.Crash:
    return crash_data.simulate()


@pytest.fixture(scope="module")
def streams(crash) -> dict[str, list]:
    """Blocks of two estimators, one starting 30 % too stiff, one 20 % too soft."""
    return {
        name: crash_data.estimates(crash, name, error, seed=seed)
        for name, error, seed in zip(NAMES, (0.3, -0.2), (1, 2))
    }


@pytest.fixture(scope="module")
def cast(crash, streams) -> Cast:
    cast = Cast(crash_data.test_block(crash), (crash.time_ns[0] * 1e-9, crash.time_ns[-1] * 1e-9))
    for name in NAMES:
        cast = cast.with_member(member(*streams[name][:3]))
    return cast


def recorder(rrd: Path | str, **settings) -> Recorder:
    return Recorder(Sinks(0, rrd), NAMES, **settings)


def feed(target: Recorder, crash: crash_data.Crash, streams: dict[str, list], run: int = 0, batches: int = 5) -> None:
    """All blocks as a replay would bring them, in some batches, events last."""
    target.put(lambda: crash_data.test_block(crash))
    count = len(streams[NAMES[0]])
    for i in range(count):
        for name in NAMES:
            target.put(lambda block=streams[name][i]: block._replace(run=run))
        if i % (count // batches) == 0:
            settle(target)
    for name in NAMES:
        for event in crash_data.events(crash, name, run):
            target.put(lambda event=event: event)
    settle(target)


def settle(target: Recorder, patience: float = 20.0) -> None:
    deadline = time.monotonic() + patience
    while not target.idle:
        assert time.monotonic() < deadline, "the recorder does not come to an end"
        time.sleep(0.01)


@pytest.fixture(scope="module")
def rrd(crash, streams, tmp_path_factory) -> Path:
    """The recording of both estimators."""
    path = tmp_path_factory.mktemp("viewer") / "crash.rrd"
    target = recorder(path)
    feed(target, crash, streams)
    assert target.complete
    assert target.close() == [f"wrote {path}: mrls 1500 of 1500 samples, ckf 1500 of 1500 samples"]
    return path


def rows(path: Path) -> dict[str, int]:
    """Temporal rows of every entity of a recording."""
    found: dict[str, int] = {}
    for chunk in RrdReader(path).stream():
        if not chunk.is_static:
            found[chunk.entity_path] = found.get(chunk.entity_path, 0) + chunk.num_rows
    return found


def column(path: Path, entity: str, component: str) -> tuple[np.ndarray, list[np.ndarray]]:
    """Times (ns) and flat values of a component of an entity, in order of time."""
    rows_: list[tuple[int, np.ndarray]] = []
    for chunk in RrdReader(path).stream():
        if chunk.entity_path == entity and not chunk.is_static:
            batch = chunk.to_record_batch()
            times = batch.column("crash_time").cast("int64").to_pylist()
            rows_ += zip(times, values_of(batch, component))
    rows_.sort(key=lambda row: row[0])
    return np.array([time_ns for time_ns, _ in rows_]), [values for _, values in rows_]


def values_of(batch, component: str) -> list[np.ndarray]:
    """Flat values in each row of a record batch; none where it has no such component."""
    for field, data in zip(batch.schema, batch.columns):
        if (field.metadata or {}).get(b"rerun:component") == component.encode():
            return [np.ravel(row) for row in data.to_pylist()]
    return []


def series(path: Path, entity: str, component: str) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,) and values (n, width) of a component whose rows are alike."""
    times, values = column(path, entity, component)
    return times, np.array(values)


def views(part: Container | View) -> list[View]:
    return [part] if isinstance(part, View) else [view for sub in part.contents for view in views(sub)]


# What is in the file


def test_every_view_of_every_tab_has_data(rrd, cast):
    found = rows(rrd)
    shown = [view for tab in layout.TABS for view in views(tab(cast))]
    assert {view.class_identifier for view in shown} == {"TimeSeries", "2D", "StateTimeline", "TextLog", "TextDocument"}
    for view in shown:
        origin = "/" + view.origin.strip("/")
        inside = [n for entity, n in found.items() if entity == origin or entity.startswith(origin + "/")]
        assert sum(inside) > 0, f"nothing in view {view.name!r} of {origin}"


def test_titles_and_legends_name_estimators_and_units(cast):
    names = [view.name for tab in layout.TABS for view in views(tab(cast))]
    assert "cab: acceleration, g" in names
    assert "barrier: force, kN" in names
    assert "engine: residual and its 99 % band, g" in names
    assert "cab_barrier.stiffness and its ± σ band, N/mm" in names
    assert "moving masses, springs coloured by force, kN" in names
    assert layout.blueprint(cast).time_panel.timeline == "crash_time"


def test_curves_hold_every_sample_in_engineering_units(rrd, crash, streams):
    times, measured = series(rrd, "/signal/cab/measured", "Scalars:scalars")
    assert_array_equal(times, crash.time_ns)
    assert_allclose(measured[:, 0], crash.measured[:, 0] / G)
    _, force = series(rrd, "/signal/barrier/model/ckf", "Scalars:scalars")
    predicted = np.concatenate([b.predicted[:, 2] for b in streams["ckf"] if isinstance(b, ResidualBlock)])
    assert_allclose(force[:, 0], predicted / 1e3)


def test_bands_are_99_percent_of_the_residual_and_one_sigma_of_the_parameter(rrd, streams):
    _, variance = series(rrd, "/residual/engine/band/mrls", "Measurements:variances")
    assert_allclose(np.sqrt(variance[:, 0]), BAND * crash_data.NOISE[1] / G)
    _, variance = series(rrd, "/parameter/cab_barrier.stiffness/mrls", "Measurements:variances")
    std = np.concatenate([b.std[:, 0] for b in streams["mrls"] if isinstance(b, ParameterBlock)])
    assert_allclose(np.sqrt(variance[:, 0]), std / 1e3)


def test_loops_are_the_force_over_the_crush_in_one_line(rrd, crash):
    times, strips = column(rrd, "/force_crush/cab_barrier/data/mrls", "LineStrips2D:strips")
    ends = np.array([strip.reshape(-1, 2)[-1] for strip in strips])
    starts = np.array([strip.reshape(-1, 2)[0] for strip in strips])
    assert_allclose(starts[1:], ends[:-1], rtol=1e-5)
    at = np.searchsorted(crash.time_ns, times)
    assert_allclose(ends[:, 0], 1e3 * crash.crush[at, 0], rtol=1e-5, atol=1e-3)  # mm; single precision
    assert ends[:, 0].max() == pytest.approx(1e3 * crash.crush[:, 0].max(), rel=0.01)


def test_axes_of_the_loops_hold_all_of_the_loop(rrd, crash):
    transforms = [
        c for c in RrdReader(rrd).stream() if c.entity_path == "/force_crush/cab_barrier/data" and c.is_static
    ]
    scale = values_of(transforms[-1].to_record_batch(), "Transform3D:mat3x3")[-1].reshape(3, 3).T
    right, top = 1e3 * crash.crush[:, 0].max() * scale[0, 0], 1e-3 * crash.force[:, 0].max() * -scale[1, 1]
    assert 0.5 * WIDTH < right <= WIDTH
    assert 0.5 * HEIGHT < top <= HEIGHT


def test_the_moving_masses_are_true_to_scale_and_the_springs_touch_them(rrd, crash):
    """All frames are drawn to one scale, also those from before the largest crush was known."""
    times, cab = series(rrd, "/motion/mrls/body/cab", "Transform3D:translation")
    newest = times % 1000 == (times % 1000).max()  # each drawing of a frame goes 1 ns after the one before
    at = np.searchsorted(crash.time_ns, times[newest] - (times % 1000).max())
    travel = cab[newest, 0] - cab[newest, 0][0]
    assert_allclose(travel / travel.max(), crash.crush[at, 0] / crash.crush[at, 0].max(), atol=1e-5)
    _, spring = series(rrd, "/motion/mrls/spring/cab_barrier", "Transform3D:translation")
    _, stretch = series(rrd, "/motion/mrls/spring/cab_barrier", "Transform3D:scale")
    _, barrier = series(rrd, "/motion/mrls/body/barrier", "Transform3D:translation")
    left, right = spring[:, 0] - cab[:, 0], spring[:, 0] + stretch[:, 0] - barrier[:, 0]
    assert_allclose(left, left[0], atol=1e-5)
    assert_allclose(right, right[0], atol=1e-5)
    assert (stretch[newest, 0] > 0).all()


def test_lanes_hold_changes_only_and_events_their_time(rrd, crash):
    times, states = column(rrd, "/state/cab_barrier/ckf", "StateChange:state")
    assert [str(s[0]) for s in states] == ["apart", "loading", "unloading", "apart"]
    assert times[2] == pytest.approx(crash.time_ns[np.argmax(crash.crush[:, 0])], abs=300_000)
    times, texts = column(rrd, "/event/mrls", "TextLog:text")
    assert len(texts) == 6
    assert any("cab_barrier: unloading" in str(t[0]) and "mrls" in str(t[0]) for t in texts)


def test_the_table_of_errors_is_that_of_the_residuals(rrd, crash, streams):
    _, documents = column(rrd, "/summary", "TextDocument:text")
    table = str(documents[-1][0])
    blocks = [b for b in streams["mrls"] if isinstance(b, ResidualBlock)]
    residual = np.concatenate([b.residual[:, 0] for b in blocks])[crash.time_ns >= 0]
    line = next(line for line in table.splitlines() if line.startswith("| cab, g"))
    assert float(line.split("|")[2]) == pytest.approx(np.sqrt(np.mean(residual**2)) / G, rel=5e-3)  # three digits
    assert "| cab_barrier K, N/mm | 40" in table


def test_the_file_ends_with_its_footer_and_its_layout_comes_before_the_data(rrd):
    assert rrd.read_bytes()[-12:-4] == b"RRF2FOOT"
    reader = RrdReader(rrd)  # warns, which is an error here, where there is no footer
    assert len(reader.blueprints()) == 1
    assert rrd.stat().st_size < 4_000_000


# What is on the picture


@pytest.fixture(scope="module")
def picture(rrd, tmp_path_factory) -> np.ndarray:
    path = tmp_path_factory.mktemp("picture") / "crash.png"
    try:
        screenshot(rrd, path, at=0.05)
    except ScreenshotError as error:
        pytest.skip(f"no picture without a screen on this machine: {error}")
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def near(picture: np.ndarray, color: tuple[int, int, int], tolerance: int = 30) -> np.ndarray:
    return np.abs(picture - np.array(color)).max(axis=2) <= tolerance


def test_the_picture_shows_measurement_and_both_estimators_in_their_colours(picture):
    assert picture.shape == (900, 1600, 3)
    plots = picture[90:860, 800:1200]  # the overview's column of measured and predicted
    assert near(plots, MEASURED).sum() > 2000
    for color in ESTIMATOR_COLORS[:2]:
        assert near(plots, color).sum() > 200
        loops = picture[490:860, :800]
        assert near(loops, color).sum() > 200


def test_the_picture_shows_bodies_and_coloured_springs(picture):
    figure = picture[90:480, :800]
    assert near(figure, (62, 74, 92), 6).sum() > 10_000  # four bodies
    red, green, blue = figure[..., 0], figure[..., 1], figure[..., 2]
    springs = (red > 200) & (green > 120) & (green < 230) & (blue < 110)
    assert springs.sum() > 500  # compressed: yellow to orange


def test_the_screenshot_command(rrd, tmp_path, capsys):
    assert main([str(tmp_path / "none.rrd"), "x.png"]) == 1
    assert capsys.readouterr().err == f"error: {tmp_path / 'none.rrd'}: no such recording\n"
    with pytest.raises(SystemExit) as usage:
        main([str(rrd), "x.png", "--size", "big"])
    assert usage.value.code == 2


# When things go wrong


def test_a_killed_viewer_disturbs_nothing(crash, streams, tmp_path):
    path = tmp_path / "killed.rrd"
    target = recorder(path)
    command = [
        viewer_binary(),
        "--headless",
        "--bind=127.0.0.1",
        f"--port={usable_port(0)}",
        "--connect",
        target.sinks.url,
    ]
    viewer = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    time.sleep(1.0)
    died_early = viewer.poll() is not None
    half = {name: stream[: len(stream) // 2] for name, stream in streams.items()}
    rest = {name: stream[len(stream) // 2 :] for name, stream in streams.items()}
    feed(target, crash, half)
    os.kill(viewer.pid, signal.SIGKILL) if not died_early else None
    viewer.wait()
    for name in NAMES:
        for block in rest[name]:
            target.put(lambda block=block: block)
    settle(target)
    target.close()
    assert rows(path)["/signal/cab/measured"] == len(crash.time_ns)
    if died_early:
        pytest.skip("the viewer itself cannot run here (see tools/screenshot-libs): only its absence was tried")


def test_a_full_queue_makes_curves_coarser_and_nobody_waits(crash, tmp_path):
    streams = {name: crash_data.estimates(crash, name, size=1) for name in NAMES}
    said = []
    target = recorder(tmp_path / "coarse.rrd", limit=600, say=said.append)
    target.put(lambda: crash_data.test_block(crash))
    target.put(lambda: time.sleep(0.5))  # Rerun is held up, as by a slow disk
    time.sleep(0.1)
    longest = 0.0
    for i in range(len(streams["mrls"])):
        for name in NAMES:
            began = time.perf_counter()
            target.put(lambda block=streams[name][i]: block, stream=(name, type(streams[name][i])))
            longest = max(longest, time.perf_counter() - began)
    event = crash_data.events(crash, "mrls")[0]
    target.put(lambda: event)
    assert longest < 0.1
    settle(target)
    lines = target.close()
    assert target.dropped > 1000
    assert lines[-1].startswith(f"{target.dropped} messages were left out of the picture")
    for name in NAMES:  # each of them is there to its end
        times, _ = series(tmp_path / "coarse.rrd", f"/signal/cab/model/{name}", "Scalars:scalars")
        assert 50 < len(times) < len(crash.time_ns)
        assert np.diff(times, prepend=crash.time_ns[0], append=crash.time_ns[-1]).max() < 10_000_000  # no hole
    assert rows(tmp_path / "coarse.rrd")["/event/mrls"] == 1
    assert said == []


def test_what_cannot_be_drawn_is_said_once_and_the_rest_goes_on(crash, streams, tmp_path):
    said = []
    target = recorder(tmp_path / "bad.rrd", say=said.append)

    def bad():
        raise ValueError("cannot reshape array of size 3 into shape (1,2)")

    target.put(bad)
    target.put(bad)
    feed(target, crash, streams)
    target.close()
    assert said == ["the viewer leaves something out: ValueError: cannot reshape array of size 3 into shape (1,2)"]
    assert rows(tmp_path / "bad.rrd")["/signal/cab/measured"] == len(crash.time_ns)


def test_an_estimator_that_contradicts_itself_does_not_harm_the_others(crash, streams, tmp_path):
    said = []
    target = recorder(tmp_path / "one.rrd", say=said.append)
    nonsense = [b._replace(between=("cab-moon",) * 3) if isinstance(b, ForceBlock) else b for b in streams["ckf"]]
    feed(target, crash, {"mrls": streams["mrls"], "ckf": nonsense})
    target.close()
    found = rows(tmp_path / "one.rrd")
    assert found["/signal/cab/model/mrls"] == len(crash.time_ns)
    assert "/signal/cab/model/ckf" not in found
    assert len(said) == 1
    assert "'cab-moon': expected two of the bodies cab, engine, barrier" in said[0]


def test_values_that_are_not_finite_leave_gaps_only(crash, streams, tmp_path):
    said = []
    target = recorder(tmp_path / "gaps.rrd", say=said.append)
    spoiled = []
    for block in streams["mrls"]:
        values = {name: getattr(block, name).copy() for name in block.over_time if getattr(block, name).dtype == float}
        for table in values.values():
            table[3], table[7] = np.nan, np.inf
        spoiled.append(block._replace(**values))
    feed(target, crash, {"mrls": spoiled, "ckf": streams["ckf"]})
    target.close()
    assert said == []
    assert rows(tmp_path / "gaps.rrd")["/signal/cab/model/mrls"] == len(crash.time_ns)
    _, cab = series(tmp_path / "gaps.rrd", "/motion/mrls/body/cab", "Transform3D:translation")
    assert np.abs(cab).max() < 10


def test_a_model_without_springs_is_shown_all_the_same(crash, streams, tmp_path):
    def bare(block):
        if isinstance(block, ForceBlock):
            n = len(block.time_ns)
            return block._replace(
                element=(), between=(), crush=np.empty((n, 0)), force=np.empty((n, 0)), state=np.empty((n, 0), int)
            )
        if isinstance(block, ParameterBlock):
            n = len(block.time_ns)
            return block._replace(
                name=(), unit=(), value=np.empty((n, 0)), std=np.empty((n, 0)), status=np.empty((n, 0), int)
            )
        return block

    said = []
    target = recorder(tmp_path / "bare.rrd", say=said.append)
    feed(target, crash, {name: [bare(block) for block in stream] for name, stream in streams.items()})
    target.close()
    assert said == []
    assert rows(tmp_path / "bare.rrd")["/signal/cab/model/mrls"] == len(crash.time_ns)


def test_each_pass_is_a_recording_and_one_complete_pass_in_a_file_is_enough(crash, streams, tmp_path):
    path = tmp_path / "loop.rrd"
    target = recorder(path)
    half = {name: stream[: len(stream) // 2] for name, stream in streams.items()}
    feed(target, crash, half, run=0)  # a seek interrupts it
    feed_run = {name: [b._replace(run=1) for b in stream] for name, stream in streams.items()}
    for run in (1, 2):
        for i in range(len(feed_run["mrls"])):
            for name in NAMES:
                target.put(lambda block=feed_run[name][i], run=run: block._replace(run=run))
        settle(target)
    lines = target.close()
    second = tmp_path / "loop-2.rrd"
    assert sorted(tmp_path.iterdir()) == [second, path]
    assert lines[0].startswith(f"wrote {path}: mrls 750 of 1500 samples")
    assert lines[1].startswith(f"wrote {second}: mrls 1500 of 1500 samples")
    assert rows(path)["/signal/cab/measured"] == 750
    assert rows(second)["/signal/cab/measured"] == 1500


def test_a_replay_started_again_does_not_go_on_in_the_old_recording(crash, streams, tmp_path):
    target = recorder(tmp_path / "again.rrd")
    half = {name: stream[: len(stream) // 2] for name, stream in streams.items()}
    feed(target, crash, half)
    feed(target, crash, streams)  # sends the test again, and run 0 again
    target.close()
    assert rows(tmp_path / "again.rrd")["/signal/cab/measured"] == 750
    assert rows(tmp_path / "again-2.rrd")["/signal/cab/measured"] == 1500


def test_who_joins_late_gets_its_place_beside_the_others(crash, streams, tmp_path, monkeypatch):
    monkeypatch.setattr("crash_estimator.viewer.passes.PATIENCE", 0.2)
    path = tmp_path / "late.rrd"
    target = recorder(path)
    target.put(lambda: crash_data.test_block(crash))
    for block in streams["mrls"]:
        target.put(lambda block=block: block)
    time.sleep(0.6)
    settle(target)
    for block in streams["ckf"]:
        target.put(lambda block=block: block)
    settle(target)
    target.close()
    found = rows(path)
    assert found["/signal/cab/model/mrls"] == found["/signal/cab/model/ckf"] == 1500
    assert len(RrdReader(path).blueprints()) == 2
    times, cab = series(path, "/motion/mrls/body/cab", "Transform3D:translation")
    times, other = series(path, "/motion/ckf/body/cab", "Transform3D:translation")
    assert other[-1, 1] > cab[-1, 1]  # its lane is below


def test_a_port_in_use_is_not_taken():
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        taken = other.getsockname()[1]
        assert usable_port(taken) not in (0, taken)
    assert usable_port(taken) == taken


def test_drawing_costs_little(crash, tmp_path):
    """Per sample and estimator; one sample in a message is the dearest case. Here it takes some 0.1 ms."""
    streams = {name: crash_data.estimates(crash, name, size=1) for name in NAMES}
    target = recorder(tmp_path / "cost.rrd")
    began = time.process_time()
    feed(target, crash, streams, batches=10)
    target.close()
    assert (time.process_time() - began) / (2 * len(crash.time_ns)) < 1e-3


# The pieces


def test_blocks_are_joined_by_estimator_kind_and_run(streams):
    blocks = [*streams["mrls"][:6], *streams["ckf"][:3], streams["mrls"][6]._replace(run=1)]
    joined = join(blocks)
    assert [(type(b), b.estimator, b.run, len(b.time_ns)) for b in joined] == [
        (ParameterBlock, "mrls", 0, 100),
        (ResidualBlock, "mrls", 0, 100),
        (ForceBlock, "mrls", 0, 100),
        (ParameterBlock, "ckf", 0, 50),
        (ResidualBlock, "ckf", 0, 50),
        (ForceBlock, "ckf", 0, 50),
        (ParameterBlock, "mrls", 1, 50),
    ]
    assert_array_equal(joined[0].value, np.vstack([streams["mrls"][0].value, streams["mrls"][3].value]))


@pytest.mark.parametrize(
    ("low", "high", "ticks"),
    [
        (0, 745, [0, 200, 400, 600, 800]),
        (-160, 745, [-200, 0, 200, 400, 600, 800]),
        (-20, 745, [0, 200, 400, 600, 800]),  # noise about zero
        (0, 0.09, [0, 0.02, 0.04, 0.06, 0.08, 0.10]),
        (-3, 0, [-3, -2, -1, 0]),
    ],
)
def test_axes_have_round_ticks(low, high, ticks):
    assert_allclose(axis_for(low, high).ticks, ticks, atol=1e-12)


def test_ticks_have_the_digits_they_need():
    assert [text(v, 0.5) for v in (-0.5, 0.0, 1.0)] == ["−0.5", "0.0", "1.0"]
    assert text(-200.0, 200.0) == "−200"
    assert [round_up(v) for v in (1.0, 1.1, 3.0, 700.0)] == [1.0, 2.0, 5.0, 1000.0]


def test_the_figure_of_engine_and_cab():
    figure = schematic((("cab", "barrier"), ("engine", "barrier"), ("cab", "engine")))
    assert figure.columns == {"cab": 0, "engine": 1, "barrier": 2}
    assert figure.row_count == 2
    assert figure.rows[0] != figure.rows[1] == figure.rows[2]  # past the engine; through it
    assert figure.reference == "barrier"


def test_the_figure_of_the_dummy_has_no_spring_through_a_body():
    between = (("upper", "rib"), ("rib", "spine"), ("lower", "pelvis"), ("car", "pelvis"), ("pelvis", "spine"))
    figure = schematic(between)
    assert figure.row_count == 3
    spans = figure.heights
    for one in spans:
        for other in spans:
            if one < other and figure.columns[one] == figure.columns[other]:
                assert spans[one][1] < spans[other][0] or spans[other][1] < spans[one][0]


def test_a_ring_of_springs_still_has_a_figure():
    figure = schematic((("a", "b"), ("b", "c"), ("c", "a")))
    assert set(figure.columns) == {"a", "b", "c"}


def test_frames_are_few_for_a_long_block_and_one_for_a_short_one():
    time_ns = np.arange(10_000) * 100_000
    ends = frame_ends(time_ns, (0.0, 1.0))
    assert len(ends) == FRAMES
    assert ends[-1] == 9999
    assert_array_equal(frame_ends(time_ns[:3], (0.0, 1.0)), [2])


def test_an_estimate_that_runs_away_does_not_squash_the_plot(streams):
    parameters, residuals, forces = join(streams["mrls"])
    limits = Limits()
    wild = residuals.predicted.copy()
    wild[700, 0] = 1e9
    drawn = limits.predicted(residuals._replace(predicted=wild), 0)
    assert drawn.max() == PREDICTION * np.abs(residuals.measured[:, 0]).max()
    assert_array_equal(np.delete(drawn, 700), np.delete(residuals.predicted[:, 0], 700))
    wild = parameters.value.copy()
    wild[700, 1] = 1.01 * PARAMETER * wild[:, 1].max()
    drawn = limits.parameter(parameters._replace(value=wild), 1)
    assert np.flatnonzero(np.isnan(drawn)).tolist() == [700]
    assert limits.force(forces) > np.abs(forces.force).max()
    assert limits.force(forces) < 10 * np.abs(forces.force).max()


def test_a_stiffness_that_grows_when_contact_begins_is_drawn(streams):
    """Long before it nothing but the first guess was there; it must not count as what the stiffness usually is."""
    parameters = join(streams["mrls"])[0]
    value, std = np.full_like(parameters.value, 50.0), np.full_like(parameters.value, 50.0)
    value[1200:], std[1200:] = 400.0, 10.0
    drawn = Limits().parameter(parameters._replace(value=value, std=std), 0)
    assert_array_equal(drawn, value[:, 0])


def test_forces_of_light_bodies_are_in_newton(cast):
    light = cast.members[0]._replace(masses=(0.6, None, None))
    assert cast.shown("N").unit == "kN"
    assert Cast(cast.test, cast.span, (light,)).shown("N") == ("N", 1.0)


def test_an_estimator_keeps_its_colour_and_is_told_apart_by_its_model(cast):
    other = cast.members[1]._replace(name="kalman_frontal_single", model="frontal_single")
    three = cast.with_member(other)
    assert [three.color(name) for name in three.names] == list(ESTIMATOR_COLORS[:3])
    assert cast.label("mrls") == "mrls"
    assert three.label("mrls") == "mrls (frontal_engine_cab)"
    assert three.label("kalman_frontal_single") == "kalman_frontal_single"
    assert cast.with_member(cast.members[0]) == cast


def test_body_names_may_hold_hyphens():
    assert cast_module._ends("a-b-c", ("a", "a-b", "c")) == ("a-b", "c")
    with pytest.raises(ValueError, match="expected two of the bodies a, b"):
        cast_module._ends("a-x", ("a", "b"))


def test_only_the_first_event_of_a_stretch_is_listed():
    def event(time: float, kind: str = "rewound") -> EventBlock:
        return EventBlock("mrls", 0, 0, time, kind, "", "rewound")

    states = States(pen=None)
    stretch = [event(0.010 + 1e-4 * k) for k in range(200)]
    assert [states._repeats(e) for e in stretch] == [False] + [True] * 199
    assert not states._repeats(event(0.0302, "clamped"))
    assert not states._repeats(event(0.0402))


@pytest.mark.parametrize(
    ("value", "std", "written"),
    [(1543.2, 23.0, "1540 ± 20"), (0.12345, 0.0021, "0.123 ± 0.002"), (5.0, 0.0, "5"), (419.0, 1.2, "419 ± 1")],
)
def test_values_are_written_to_the_first_digit_of_their_sigma(value, std, written):
    assert with_std(value, std) == written
