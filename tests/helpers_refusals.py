"""What is refused says so in one line; valid input with something changed in it."""

from pathlib import Path

import pytest

from crash_estimator.core.structure import ModelError
from crash_estimator.fuzz.worker import laid_out
from crash_replay.recording import RecordingError

ERRORS = (RecordingError, ModelError)
BOMB = "X0: &X0 [1,1,1,1,1,1,1,1,1]\n" + "".join(
    f"X{k}: &X{k} [{','.join([f'*X{k - 1}'] * 9)}]\n" for k in range(1, 10)
)


def refused(take, *arguments) -> str:
    with pytest.raises(ERRORS) as caught:
        take(*arguments)
    line = str(caught.value)
    assert line.isprintable() and len(line) < 1200
    return line


def changed(files: dict[str, bytes], folder: Path, name: str, old: str, new: str) -> Path:
    text = files[name].decode()
    assert old in text
    laid_out(files | {name: text.replace(old, new, 1).encode()}, folder)
    return folder
