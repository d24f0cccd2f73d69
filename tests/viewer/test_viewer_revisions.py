"""After an effect was added: every tab compares the revisions, and the newest is in front.

The pictures of every tab before and after are left in out/tabs, to be looked at.
"""

from pathlib import Path

import helpers_viewer as crash_data
import numpy as np
import pytest
from helpers_findings import story
from helpers_paths import ROOT
from helpers_viewer import series, settle, with_damping
from numpy.testing import assert_allclose
from PIL import Image

from crash_estimator.core.structure import Structure
from crash_estimator.model_file import load_model
from crash_estimator.viewer.blocks import Block, ParameterBlock, ResidualBlock, speaker
from crash_estimator.viewer.cast import Cast, member
from crash_estimator.viewer.colors import ESTIMATOR_COLORS, REVISION_COLORS, faded
from crash_estimator.viewer.curves import BAND
from crash_estimator.viewer.recorder import Recorder
from crash_estimator.viewer.screenshot import ScreenshotError, screenshots
from crash_estimator.viewer.sinks import Sinks

pytestmark = pytest.mark.usefixtures("strict")

NAME, REVISED = "ckf", speaker("ckf", 1)
NEWEST, OLD = ESTIMATOR_COLORS[0], faded(ESTIMATOR_COLORS[0])
SIZE = (1200, 675)
"""Pixels: large enough for every view, and drawn in less time than what a screen has."""
COMPARED = {
    "Overview", "Measured and model", "Residuals", "Parameters", "Force over crush", "Motion and states", "Events",
    "Validation", "Missing effect",
}  # fmt: skip


@pytest.fixture(scope="module")
def crash() -> crash_data.Crash:
    return crash_data.simulate(n=900)


@pytest.fixture(scope="module")
def structure() -> Structure:
    return load_model("frontal_engine_cab")


def said(crash: crash_data.Crash, who: str, error: float) -> list[Block]:
    blocks = crash_data.estimates(crash, who, error=error)
    return [with_damping(block) if isinstance(block, ParameterBlock) else block for block in blocks]


def recorded(path: Path, crash: crash_data.Crash, structure: Structure, *spoken: list[Block]) -> Path:
    known = lambda estimator, revision, model: structure  # noqa: E731
    target = Recorder(Sinks(0, path), (NAME,), say=pytest.fail, structure_of=known)
    findings = story(crash)
    target.put(lambda: crash_data.test_block(crash))
    for finding in findings if len(spoken) > 1 else findings[:-3]:
        target.put(lambda finding=finding: finding)
    for blocks in spoken:
        for block in blocks:
            target.put(lambda block=block: block)
        settle(target)
    for event in crash_data.events(crash, NAME):
        target.put(lambda event=event: event)
    settle(target)
    assert target.complete
    target.close()
    return path


def pictures(rrd: Path, folder: Path) -> dict[str, np.ndarray]:
    try:
        written = screenshots(rrd, folder, size=SIZE)
    except ScreenshotError as error:
        pytest.skip(f"no picture without a screen on this machine: {error}")
    return {tab: np.asarray(Image.open(png).convert("RGB")).astype(int) for tab, png in written.items()}


def count(picture: np.ndarray, color: tuple[int, int, int], tolerance: int = 6) -> int:
    return int((np.abs(picture - np.array(color)).max(axis=2) <= tolerance).sum())


@pytest.fixture(scope="module")
def after(crash, structure, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("after") / "crash.rrd"
    return recorded(path, crash, structure, said(crash, NAME, 0.3), said(crash, REVISED, 0.0))


def test_every_tab_compares_the_revisions(crash, structure, after, tmp_path):
    before = recorded(tmp_path / "before.rrd", crash, structure, said(crash, NAME, 0.3))
    first, then = (pictures(rrd, ROOT / "out/tabs" / name) for rrd, name in ((before, "before"), (after, "after")))
    assert first.keys() == then.keys() == COMPARED
    for tab in COMPARED - {"Missing effect"}:
        assert (first[tab] != then[tab]).any(axis=2).mean() > 0.002, f"{tab} does not show what was added"
    for tab in COMPARED - {"Missing effect", "Events", "Motion and states"}:
        assert count(then[tab], NEWEST) > 100, f"{tab} does not show the newest revision"
        assert count(then[tab], OLD) > 100, f"{tab} does not show the model as given"
        assert count(first[tab], OLD) < 0.1 * count(then[tab], OLD), f"{tab}: before, nothing is old"
    for color in REVISION_COLORS[:2]:
        assert count(then["Missing effect"], color) > 100


def test_the_newest_revision_is_the_one_in_front(crash, structure, tmp_path):
    """Where both say the same, only the newest can be seen."""
    same = said(crash, NAME, 0.0), said(crash, REVISED, 0.0)
    shown = pictures(recorded(tmp_path / "same.rrd", crash, structure, *same), tmp_path)
    key = 400  # pixels that the older one's name takes in the legends
    for tab in ("Overview", "Measured and model", "Residuals", "Force over crush"):
        old, new = count(shown[tab], OLD), count(shown[tab], NEWEST)
        assert new > 500, f"{tab} does not show the newest revision"
        assert old < max(key, 0.1 * new), f"{tab}: the older revision is in front"


def test_a_model_that_fails_has_no_wider_band(crash, structure, tmp_path):
    """An estimator whose own standard deviation swells with its error leaves the band as it is."""
    blocks = said(crash, NAME, 0.3)
    swollen = [b._replace(residual_std=50.0 * b.residual_std, innovation_std=50.0 * b.innovation_std)
               if isinstance(b, ResidualBlock) else b for b in blocks]  # fmt: skip
    bands = []
    for k, spoken in enumerate((blocks, swollen)):
        path = recorded(tmp_path / f"{k}.rrd", crash, structure, spoken)
        bands.append(series(path, "/residual/engine/band/whole", "Measurements:variances")[1])
    assert_allclose(bands[0], bands[1])
    noise = np.sqrt(bands[0]) / BAND * 9.80665
    assert_allclose(noise, crash_data.NOISE[1], rtol=3 / np.sqrt(2 * 100))  # as near as 100 samples at rest tell
    residual = np.concatenate([b.residual[:, 1] for b in blocks if isinstance(b, ResidualBlock)])
    assert np.mean(np.abs(residual) > BAND * noise.max()) > 0.1, "and so its failure lies outside"


def test_revisions_stand_together_and_the_newest_keeps_the_colour(crash):
    cast = Cast(crash_data.test_block(crash), (-0.01, 0.08))
    for who in (NAME, "mrls", REVISED):
        blocks = crash_data.estimates(crash, who)
        cast = cast.with_member(member(*blocks[:3]))
    assert cast.names == (REVISED, NAME, "mrls")
    assert [m.name for m in cast.newest] == [REVISED, "mrls"]
    assert [cast.color(name) for name in cast.names] == [NEWEST, OLD, ESTIMATOR_COLORS[1]]
    assert [cast.label(name) for name in cast.names] == ["ckf revision 1", "ckf as given", "mrls"]
