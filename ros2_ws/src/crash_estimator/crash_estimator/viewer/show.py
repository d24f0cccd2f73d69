"""One pass over a recording on the screen: blocks in, Rerun data out."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import rerun as rr

from . import method, validation
from .blocks import UNKNOWN_TEST, Block, EventBlock, ForceBlock, ParameterBlock, ResidualBlock, join
from .cast import Cast
from .curves import Curves
from .findings import Finding
from .judged import Judged
from .layout import blueprint, tabs
from .loops import Loops
from .missing import Missing, cast_with
from .motion import Motion
from .pen import Pen
from .readable import plots, rounded, set_axes
from .sinks import send_layout
from .states import States
from .summary import Summary

Attempt = Callable[[Callable[[], Any]], Any]


class Show:
    """Writes what the estimators say in one run into one Rerun recording."""

    def __init__(
        self,
        recording: rr.RecordingStream,
        cast: Cast,
        activate: bool,
        attempt: Attempt,
        sent: list[Cast] | None = None,
    ):
        """activate: show this layout at once; otherwise whoever arranged the views anew keeps their arrangement.

        attempt: calls what may fail for one estimator and must not harm the others.
        sent: the casts whose layouts its viewers have, to be added to: they hold for all recordings of a session, and
        the server keeps each of them to the end.
        """
        self.recording, self.activate, self.attempt = recording, activate, attempt
        self.sent = [] if sent is None else sent
        self.pen = Pen(recording)
        self.curves, self.loops, self.motion = Curves(self.pen), Loops(self.pen), Motion(self.pen)
        self.states, self.missing = States(self.pen), Missing(self.pen)
        self.summary = Summary(self.pen, self.curves.noise)
        self.set_cast(cast)

    def set_cast(self, cast: Cast) -> None:
        """The layout for this cast; views change when an estimator joins, data that are written stay."""
        self.cast = cast
        self.pen.set_cast(cast)
        self.motion.set_cast(cast)
        self.states.draw(cast)
        laid_out = replace(cast, test=UNKNOWN_TEST)  # tests of one structure and length look alike
        if laid_out not in self.sent:
            layout = blueprint(cast)
            send_layout(self.recording, layout, self.activate, set_axes(layout.root_container, cast))
            self.sent.append(laid_out)

    def _fit(self, cast: Cast) -> None:
        """Axes and the figure's frame as the data need them."""
        cast = replace(cast, reach=self.motion.frame())
        origins = {str(plot.view.origin).strip("/") for tab in tabs(cast) for plot in plots(tab)}
        ranges = {origin: self.pen.range_under(f"/{origin}") for origin in sorted(origins)}
        known = tuple((origin, rounded(*range_)) for origin, range_ in ranges.items() if range_[0] <= range_[1])
        self.set_cast(replace(cast, ranges=known))

    def write(self, items: Sequence[Block | EventBlock | Finding]) -> None:
        """What members of the cast and the diagnosis say, in the order it came; the more at a time, the cheaper."""
        for finding in (item for item in items if isinstance(item, Finding)):
            self.attempt(partial(self._write_finding, finding))
        blocks = [item for item in items if not isinstance(item, (EventBlock, Finding))]
        for block in join(blocks):
            self.attempt(partial(self._write_block, block))
        self.states.write_events([item for item in items if isinstance(item, EventBlock)])
        if blocks:
            self.summary.write(self.cast)

    def _write_finding(self, finding: Finding) -> None:
        cast = cast_with(self.cast, finding)
        if cast != self.cast:
            self.set_cast(cast)
        self.missing.write(self.cast, finding)

    def _write_block(self, block: Block) -> None:
        match block:
            case ParameterBlock():
                self.curves.write_parameters(self.cast, block)
                method.write(self.pen, block)
                self.summary.add_parameters(block)
            case ResidualBlock():
                self.curves.write_residuals(self.cast, block)
                self.summary.add_residuals(block)
            case ForceBlock():
                self.loops.write(self.cast, block)
                self.motion.write(self.cast, block)
                if self.motion.frame(self.cast.reach) != self.cast.reach:
                    self.set_cast(replace(self.cast, reach=self.motion.frame(self.cast.reach)))
                self.states.write(self.cast, block)

    def judge(self, judged: Mapping[str, Judged]) -> None:
        """A pass is whole; what the validation says of each member that it can judge is a tab of its own."""
        self.curves.finish(self.cast)
        validation.write(self.pen, self.cast, judged)
        self._fit(replace(self.cast, whole=True, judged=tuple(judged)))

    def finish(self, incomplete: str = "") -> None:
        """The last sample has been written; incomplete: what is missing all the same."""
        self.motion.finish(self.cast)
        self.missing.finish()
        self._fit(self.cast)
        self.summary.incomplete = incomplete
        self.summary.write(self.cast)
