"""`report`: one recording's tables and figures as a page."""

import argparse
from pathlib import Path

from crash_replay.fault import tell
from crash_replay.foreign_text import visible
from crash_replay.output import OutputError
from crash_replay.said import say

from ...model_file import load_model
from ...report_page import write_report
from ..common import check_written, effects_of, read_crash, refuse_empty_channels
from .simulate import smoother


def report(arguments: argparse.Namespace) -> None:
    folder = Path(arguments.to)
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"{visible(folder)} is a file: --to takes a folder")
    check_written(arguments, arguments.bag, to=folder / "report.html")
    effects = effects_of(arguments)
    structure = load_model(arguments.model, effects)
    recording = read_crash(arguments.bag)
    refuse_empty_channels(structure, recording)
    smooth, said = smoother(recording, arguments.cfc)
    page = write_report(
        recording, structure, list(dict.fromkeys(arguments.methods)), folder, arguments.end, smooth, said,
        effects=effects, markdown=arguments.markdown, seconds=arguments.time_limit, told=tell,
    )  # fmt: skip
    say(f"{recording.test.id}: {visible(page)}")
