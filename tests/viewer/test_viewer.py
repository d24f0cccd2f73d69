"""The viewer's drawings, without ROS: what is in the .rrd of two estimators, and what is on its picture."""

from pathlib import Path
from types import SimpleNamespace

import helpers_viewer as crash_data
import numpy as np
import pytest
from helpers_viewer import column, feed, recorder, rows, series, values_of
from numpy.testing import assert_allclose, assert_array_equal
from PIL import Image
from rerun.blueprint.api import Container, View
from rerun.chunk import RrdReader

from crash_estimator.viewer import layout
from crash_estimator.viewer.blocks import ForceBlock, ParameterBlock, ResidualBlock
from crash_estimator.viewer.colors import BODY, ESTIMATOR_COLORS, MEASURED, STATE_COLORS
from crash_estimator.viewer.curves import BAND
from crash_estimator.viewer.loops import HEIGHT, WIDTH
from crash_estimator.viewer.screenshot import ScreenshotError, main, screenshot
from crash_estimator.viewer.states import STATES, States, lanes_drawing

G = 9.80665

pytestmark = pytest.mark.usefixtures("strict")


@pytest.fixture(scope="module")
def rrd(crash, streams, tmp_path_factory) -> Path:
    """The recording of both estimators."""
    path = tmp_path_factory.mktemp("viewer") / "crash.rrd"
    target = recorder(path)
    feed(target, crash, streams)
    assert target.complete
    assert target.close() == [f"wrote {path}: mrls 1500 of 1500 samples, ckf 1500 of 1500 samples"]
    return path


def views(part: Container | View) -> list[View]:
    return [part] if isinstance(part, View) else [view for sub in part.contents for view in views(sub)]


# What is in the file


def test_every_view_of_every_tab_has_data(rrd, cast):
    found = rows(rrd)
    shown = [view for tab in layout.TABS for view in views(tab(cast))]
    assert {view.class_identifier for view in shown} == {"TimeSeries", "2D", "TextLog", "TextDocument"}
    for view in shown:
        origin = "/" + view.origin.strip("/")
        inside = [n for entity, n in found.items() if entity == origin or entity.startswith(origin + "/")]
        assert sum(inside) > 0, f"nothing in view {view.name!r} of {origin}"


def test_titles_and_legends_name_estimators_and_units(cast):
    names = [view.name for tab in layout.TABS for view in views(tab(cast))]
    assert "cab: acceleration, g" in names
    assert "barrier: force, kN" in names
    assert "engine: residual, with the noise's 99 % band, g" in names
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


def test_bands_are_99_percent_of_the_channels_noise_and_one_sigma_of_the_parameter(rrd, crash, streams):
    """The noise is found from the measurement: as near as 100 samples at rest tell, whatever the estimators believe."""
    times, variance = series(rrd, "/residual/engine/band/whole", "Measurements:variances")
    assert times.tolist() == [crash.time_ns[0], crash.time_ns[-1]] and variance[0] == variance[1]
    assert_allclose(np.sqrt(variance[:, 0]), BAND * crash_data.NOISE[1] / G, rtol=3.0 / np.sqrt(2 * 100))
    _, variance = series(rrd, "/parameter/cab_barrier.stiffness/model/mrls", "Measurements:variances")
    std = np.concatenate([b.std[:, 0] for b in streams["mrls"] if isinstance(b, ParameterBlock)])
    assert_allclose(np.sqrt(variance[:, 0]), std / 1e3)


def test_loops_are_the_force_over_the_crush_in_one_line(rrd, crash):
    times, strips = column(rrd, "/force_crush/cab_barrier/data/model/mrls", "LineStrips2D:strips")
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


def test_lanes_hold_changes_only(cast, crash, streams):
    states = States(pen=None)
    states.draw = lambda cast: None
    states.pen = SimpleNamespace(once=lambda *_: None, columns=lambda *_: None)
    for block in (b for b in streams["ckf"] if isinstance(b, ForceBlock)):
        states.write(cast, block)
    changes = states.changes["cab_barrier", "ckf"]
    assert [STATES[state] for _, state in changes] == ["apart", "loading", "unloading", "apart"]
    assert changes[2][0] == pytest.approx(1e-9 * crash.time_ns[np.argmax(crash.crush[:, 0])], abs=3e-4)
    drawing = lanes_drawing(cast, states.changes, states.until)
    assert "cab_barrier, ckf" in drawing.texts and {"0 ms", "100 ms"} <= set(drawing.texts)
    bars = [s for s, c in zip(drawing.strips, drawing.strip_colors) if c in STATE_COLORS]
    assert len(bars) == sum(map(len, states.changes.values()))


def test_events_have_their_time_and_severity(rrd):
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
    assert 1 <= len(reader.blueprints()) <= 5, "the first, where the figure needs more room, and with axes in the end"
    assert rrd.stat().st_size < 5_000_000, "each layout takes a third of a MB"


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
    assert near(figure, BODY, 6).sum() > 10_000  # four bodies
    red, green, blue = figure[..., 0], figure[..., 1], figure[..., 2]
    springs = (red > 180) & (green > 40) & (green < 150) & (blue < 60)
    assert springs.sum() > 500  # compressed: orange to red


def test_a_viewer_that_answers_and_then_stops_is_an_error_that_says_what_it_said(rrd, tmp_path, monkeypatch):
    """As where there is no graphics library."""
    viewer, has_said = tmp_path / "viewer", tmp_path / "has_said"
    panic = "thread 'main' panicked at 'no context'"
    viewer.write_text(f'#!/bin/sh\necho "{panic}" >&2\necho "0: stack" >&2\ntouch {has_said}\nexec sleep 60\n')
    viewer.chmod(0o755)

    class Gone:
        connect = classmethod(lambda cls, url: cls())

        def get_state(self):
            if not has_said.exists():
                raise ConnectionError("not yet")

        def open(self, path):
            raise ConnectionError("transport error")

    monkeypatch.setattr("crash_estimator.viewer.screenshot.viewer_binary", lambda: str(viewer))
    monkeypatch.setattr("crash_estimator.viewer.screenshot.ViewerClient", Gone)
    with pytest.raises(ScreenshotError, match=f"stopped, saying: {panic} "):
        screenshot(rrd, tmp_path / "crash.png")


def test_the_screenshot_command(rrd, tmp_path, capsys):
    assert main([str(tmp_path / "none.rrd"), "x.png"]) == 1
    assert capsys.readouterr().err == f"error: {tmp_path / 'none.rrd'}: no such recording\n"
    with pytest.raises(SystemExit) as usage:
        main([str(rrd), "x.png", "--size", "big"])
    assert usage.value.code == 2
