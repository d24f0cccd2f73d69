"""What it costs to make the messages of one sample by name, beside those of a block of one."""

from collections import deque
from pathlib import Path

from crash_replay.recording import Recording

from ..core.methods import make_estimator
from ..following.follower import Follower
from ..kept import Kept, Rows
from ..model_file import load_model
from ..nodes.estimate_messages import EstimateMessages
from ..nodes.named_estimates import NamedMessages
from .speed_row import Row, microseconds, per_call


def making(model: Path, recording: Recording) -> Row:
    """Parameters and residuals, serialised, of the recording's last sample."""
    estimator = make_estimator(load_model(str(model)), recording.test, "constrained_kalman")
    follower, last = Follower(estimator, Kept(recording.test)), len(recording) - 1
    columns = None
    for number in (slice(0, last), slice(last, last + 1)):
        rows = Rows(number.start, recording.time_ns[number], recording.values[number])
        follower.keep(rows)
        columns = follower.follow(rows)
    named, blocks = (kind(estimator.description) for kind in (NamedMessages, EstimateMessages))

    def by_name() -> None:
        deque(named.parameters(0, 0, columns), 0)
        deque(named.residuals(0, 0, columns), 0)

    def in_blocks() -> None:
        blocks.parameters(0, 0, columns)
        blocks.residuals(0, 0, columns)

    ours, theirs = per_call(by_name), per_call(in_blocks)
    what = f"parameters and residuals of a sample by name, made and serialised ({len(estimator.description.parameters)}"
    what += f" parameters, {len(estimator.description.equations)} equations)"
    return Row(what, microseconds(ours), f"a block of one {microseconds(theirs)}", ours / theirs)
