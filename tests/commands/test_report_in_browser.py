"""The report's page as a person sees it: in a browser. The pictures are left in out/report_page, to be looked at."""

import sys

import numpy as np
import pytest
from helpers_browser import browser
from helpers_paths import BAGS, ROOT
from PIL import Image

from crash_estimator.cli import report

WIDTH, HEIGHT = 1200, 1500
OUTSIDE = """
return [...document.querySelectorAll("svg")].filter(svg => {
    const room = svg.getBoundingClientRect();
    return [...svg.querySelectorAll("text:not(:empty)")].some(text => {
        const own = text.getBoundingClientRect();
        return own.left < room.left - 1 || own.right > room.right + 1 || own.bottom > room.bottom + 1;
    });
}).length
"""


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """Of a model that lacks friction."""
    folder = tmp_path_factory.mktemp("report")
    model = str(BAGS / "hidden_effect.model.yaml")
    arguments = ["report", str(BAGS / "hidden_effect.mcap"), "--model", model, "--to", str(folder)]
    before, sys.argv = sys.argv, [*arguments, "--methods", "constrained_kalman"]
    try:
        with pytest.raises(SystemExit) as status:
            report.main()
    finally:
        sys.argv = before
    assert status.value.code == 0
    return folder / "report.html"


def test_the_page_compares_the_revisions(page):
    text = page.read_text()
    assert "revision 1 is the model with coulomb_friction on rib_spine" in text
    assert text.count("constrained_kalman revision 1") > 10
    assert text.count("99 % of the noise") == 3, "a band for each equation's error"


def test_a_browser_shows_all_of_it(page):
    with browser() as one:
        one.open(page.as_uri(), size=(WIDTH, HEIGHT), theme="light")
        assert one.run("return document.documentElement.scrollWidth") <= WIDTH, "nothing sticks out at the side"
        heads = one.run("return [...document.querySelectorAll('h1, h2')].map(head => head.innerText)")
        assert {"What is missing", "Parameters"} <= set(heads)
        outside = one.run(OUTSIDE)
        assert outside == 0, "all text of the figures lies in them"
        pictures = one.whole_page(HEIGHT)
    folder = ROOT / "out/report_page"
    folder.mkdir(parents=True, exist_ok=True)
    for k, picture in enumerate(pictures):
        Image.fromarray(picture).save(folder / f"{k}.png")
    first = pictures[0]
    assert (np.median(first, axis=(0, 1)) > 240).all() and (first < 100).all(axis=2).sum() > 10_000, "text on paper"
    drawn = np.concatenate([picture.reshape(-1, 3) for picture in pictures]).astype(int)
    for color in ((0x1F, 0x77, 0xB4), (0xD6, 0x27, 0x28), (0x2C, 0xA0, 0x2C)):  # as given, revision 1; of the free run
        assert (np.abs(drawn - color).max(axis=1) < 12).sum() > 500
