"""The parameters of `diagnosis`, with what they mean and may be."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from crash_replay.node_parameters import NAME, Allowed

from ..ready_models import MODEL

if TYPE_CHECKING:  # a table can be read without what computes
    from ..core.diagnosis import Tolerance

PARAMETERS = {
    "model": Allowed("", MODEL, needed=f"give {MODEL}"),
    "with_bags": Allowed([""], "other recordings of the same structure, used with the replayed one"),
    "effects": Allowed("", "your own effects, a .py file; it is executed"),
    "every": Allowed(0.002, "s of the crash between two rankings", 1e-5, 1e4, live=True),
    "good_enough": Allowed(
        "",
        "what may be left in every channel: a rating, as in 0.8, or a share of the peak, as in 5%; "
        "empty: 1% completes an explanation, no more",
        pattern=r"\d*\.?\d+%?",
        live=True,
    ),
    "time_limit": Allowed(
        0.0,
        "s after which the final answer is the best so far; 0: after a number of iterations, some 10 s for two dummies",
        0.0,
        1e5,
        live=True,
    ),
    "add_first": Allowed(False, "add the first effect that a final answer names, once; none where it is unexplained"),
    "estimators": Allowed([""], "names of estimators that it is added to as well", pattern=NAME),
    "replay": Allowed("", "node that samples are asked of which were missed; empty: the replay there is", pattern=NAME),
}


class Wanted(NamedTuple):
    """What may be changed while the node runs."""

    every_ns: int  # of the crash, between two rankings
    tolerance: "Tolerance | None"  # None: as it is where nobody asks for any
    seconds: float | None  # for the final answer; None: a number of iterations

    @classmethod
    def from_values(cls, values: Mapping[str, Any]) -> "Wanted":
        """Raises ModelError where what is good enough is neither a rating nor a share."""
        text = values["good_enough"]
        tolerance = None
        if text:
            from ..core.diagnosis import tolerance_of  # late: it takes long to import, and most ask for nothing

            tolerance = tolerance_of(text)
        return cls(round(values["every"] * 1e9), tolerance, values["time_limit"] or None)
