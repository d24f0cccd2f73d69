"""Short recordings for it: some 280 samples each, simulated, so that a run takes seconds."""

from pathlib import Path
from typing import NamedTuple

from crash_replay.bag import write_bag
from crash_replay.synthetic.recordings import SCENARIOS


class Short(NamedTuple):
    scenario: str
    model: str  # a ready one
    hz: float
    seconds: float  # that it lasts


RECORDINGS = {
    "side": Short("side_dummy_padded", "side_dummy", 2000.0, 0.14),
    "frontal": Short("frontal_single", "frontal_single", 2000.0, 0.14),
}
PLAYING, PLAYING_WITH_RESTART = 4.0, 20.0
"""s of wall clock that a recording is played in; longer where a process that takes seconds to start is to come back."""


def bag_of(name: str, folder: Path) -> Path:
    """The recording's file, made where it is not there yet."""
    bag = folder / f"{name}.mcap"
    if not bag.exists():
        folder.mkdir(parents=True, exist_ok=True)
        short = RECORDINGS[name]
        recording, _ = SCENARIOS[short.scenario](rate=short.hz)
        write_bag(recording, bag)
    return bag
