"""The picture of a demonstration: drawn by a process of its own, which may fail, hang and leave something behind."""

import os
import sys

import pytest
from helpers_demo import children_of

from crash_estimator.demo import picture
from crash_estimator.demo.picture import TRIES, Picture


@pytest.fixture
def rrd(tmp_path):
    (tmp_path / "log").mkdir()
    (tmp_path / "demo.png").write_bytes(b"an older one")
    return tmp_path / "demo.rrd"


def drawn_by(monkeypatch, tmp_path, code: str) -> None:
    """Let this Python stand in for what draws; sys.argv[4] is the picture."""
    script = tmp_path / "draw.sh"
    script.write_text(f'#!/bin/sh\nexec {sys.executable} -c "{code}" "$@"\n')
    script.chmod(0o755)
    monkeypatch.setattr(picture.sys, "executable", str(script))


def test_why_there_is_none_is_what_the_process_says_last(rrd, tmp_path, monkeypatch):
    drawn_by(monkeypatch, tmp_path, "import sys; sys.exit('error: it needs: apt install this')")
    assert Picture(rrd, lambda seconds: None).draw() == "it needs: apt install this"
    assert not rrd.with_suffix(".png").exists(), "the older one would pass for this one"


def test_one_that_hangs_is_ended_with_all_it_has_started_and_tried_once_more(rrd, tmp_path, monkeypatch):
    code = "import subprocess, time; subprocess.Popen(['sleep', '300']); time.sleep(300)"
    drawn_by(monkeypatch, tmp_path, code)
    waited, before = [], set(children_of(os.getpid()))
    assert Picture(rrd, waited.append, limit=1.0).draw() == "not drawn within 1 s"
    assert waited.count(waited[-1]) == TRIES
    assert set(children_of(os.getpid())) == before


@pytest.mark.parametrize(("content", "why"), [("x", ""), ("", "demo.png is empty")])
def test_a_picture_must_have_something_in_it(rrd, tmp_path, monkeypatch, content, why):
    drawn_by(monkeypatch, tmp_path, f"import sys; open(sys.argv[4], 'w').write('{content}')")
    assert Picture(rrd, lambda seconds: None).draw().endswith(why)
    assert bool(Picture(rrd, lambda seconds: None).draw()) == bool(why)
