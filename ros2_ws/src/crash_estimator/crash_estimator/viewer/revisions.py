"""Each revision of the model with its own curves: measured, as given and with what was added, and what each leaves.

While samples come, curves grow by stretches as the answer then stood; after the last sample the whole record is drawn
anew with every revision. Windows in which the model fails are shaded by what the body's elements do there.
"""

from collections.abc import Sequence

import numpy as np
import rerun.blueprint as rrb

from ..core.validation import autocorrelation
from .axes import Axis
from .cast import Cast
from .colors import FLOOR, INK, MEASURED, STATE_COLORS, Color
from .curves import BAND, NOISE, SO_FAR, WHOLE
from .drawing import Drawing, Frame, view
from .findings import EFFECT_MISSING, MisfitBlock, RankingBlock, RevisionBlock, Window
from .pen import Look, Pen, path
from .ranking import Step, error_drawing, revision_color
from .states import STATES

LAGS = 40
"""Samples."""

SHADE = 1e6
"""Height of a misfit's shade, beyond any value; the axis does not follow it."""

Stretch = tuple[float, float]


class Revisions:
    """Writes what the diagnosis says of each revision."""

    def __init__(self, pen: Pen):
        self.pen = pen
        self.whole: dict[str, RevisionBlock] = {}  # by model, in order
        self.ranking: RankingBlock | None = None  # the newest
        self.misfit: MisfitBlock | None = None  # the newest
        self.mass = 0.0  # kg, of the model as it was given: an added effect may take some of it
        self.shaded_until = 0.0  # s
        self.shaded_to: dict[str, float] = {}  # s, by entity: where its shade goes on
        self.shaded_all = False

    def write_ranking(self, cast: Cast, block: RankingBlock) -> None:
        self.ranking = block
        self._errors(cast)

    def write_revision(self, cast: Cast, block: RevisionBlock) -> None:
        if not block.final:
            self._curves(cast, block, min(len(block.changes), 1), SO_FAR)
        elif block.model not in self.whole:  # fitted again it is the same
            self.whole[block.model] = block
            self._curves(cast, block, len(self.whole) - 1, WHOLE)
            self._whiteness()
            self._errors(cast)

    def _curves(self, cast: Cast, block: RevisionBlock, revision: int, part: str) -> None:
        look, time_ns = Look(f"{revision} {block.label}", revision_color(revision)), block.time_ns
        for k, (body, si_unit) in enumerate(zip(block.name, block.unit)):
            factor = cast.shown(si_unit).factor
            if revision == 0:
                measured = path("revision", body, part, "measured")
                self.pen.curve(measured, time_ns, factor * block.measured[:, k], Look("measured", MEASURED), 3.0)
                band = BAND * factor * block.residual_std[:, k]
                self.pen.band(path("left", body, part, "band"), time_ns, 0.0 * band, band, NOISE, 0.5)
            name = f"{revision:02}"
            predicted, left = factor * block.predicted[:, k], factor * block.residual[:, k]
            self.pen.curve(path("revision", body, part, "model", name), time_ns, predicted, look, 1.5)
            self.pen.curve(path("left", body, part, "model", name), time_ns, left, look, 1.2)

    def _whiteness(self) -> None:
        blocks = list(self.whole.values())
        for k, body in enumerate(blocks[0].name):
            whiteness_drawing(blocks, k).write(self.pen, path("whiteness", body), int(blocks[0].time_ns[-1]))

    def _errors(self, cast: Cast) -> None:
        ranking = self.ranking
        if ranking is None:
            return
        if self.whole:
            self.mass = self.mass or cast.mass
            steps = [Step(block.label, _rms(block, self.mass), False) for block in self.whole.values()]
            if ranking.final and ranking.revision == 0:
                steps[0] = steps[0]._replace(white=ranking.white_before)
            if ranking.final:
                steps[-1] = steps[-1]._replace(white=ranking.white_after)
        else:
            found = ranking.verdict == EFFECT_MISSING and ranking.ranking
            steps = [Step("as given", ranking.rms_before, ranking.white_before)]
            steps += [Step(f"+ {ranking.ranking[0].name}", ranking.rms_after, ranking.white_after)] if found else []
        drawing = error_drawing(steps, ranking.noise_floor, cast.shown("m/s^2"))
        drawing.write(self.pen, "error", round(1e9 * ranking.time))

    def write_misfit(self, cast: Cast, block: MisfitBlock) -> None:
        """Shade what is new; after the last sample, all of it."""
        self.misfit = block
        if self.ranking and self.ranking.final:
            self.finish()
        elif block.windows:
            self._shade_all(SO_FAR, block.windows, self.shaded_until)
            self.shaded_until = max(window.end for window in block.windows)

    def finish(self) -> None:
        """Windows over the whole record, once."""
        if self.misfit and not self.shaded_all:
            self._shade_all(WHOLE, self.misfit.windows, -np.inf)
            self.shaded_all = True

    def _shade_all(self, part: str, windows: Sequence[Window], since: float) -> None:
        for body in dict.fromkeys(window.body for window in windows):
            for state, color in zip(STATES, STATE_COLORS, strict=False):
                own = [(max(w.start, since), w.end) for w in windows if (w.body, w.state) == (body, state)]
                own = [(start, end) for start, end in own if end > start]
                if own:
                    for kind in ("revision", "left"):
                        self._shade(path(kind, body, part, f"misfit_{state}"), own, f"fails while {state}", color)

    def _shade(self, entity: str, stretches: list[Stretch], name: str, color: Color) -> None:
        """A wide band over each stretch, a gap before it unless it goes on from the one before."""
        rows = []
        for start, end in stretches:
            rows += [(start - 1e-9, np.nan)] if start > self.shaded_to.get(entity, -np.inf) else []
            rows += [(start, 0.0), (end, 0.0)]
            self.shaded_to[entity] = end
        time_ns, center = np.array(rows).T
        time_ns = np.round(time_ns * 1e9).astype(np.int64)
        self.pen.band(entity, time_ns, center, center + SHADE, Look(name, color), 0.1)


def _rms(block: RevisionBlock, mass: float) -> float:
    """Over all outputs, m/s^2; a force counts divided by the mass of all bodies, as in the diagnosis."""
    scale = [1.0 / mass if unit == "N" else 1.0 for unit in block.unit]
    return float(np.sqrt(np.nanmean((block.residual * scale) ** 2)))


def whiteness_drawing(blocks: list[RevisionBlock], k: int) -> Drawing:
    """Auto-correlation of what the first and the last revision leave of output k, with the limits of white noise."""
    drawing = Drawing()
    frame = Frame((0.14, 0.0, 0.96, 0.9), Axis(0.0, LAGS, 10.0), Axis(-0.5, 1.0, 0.5))
    frame.draw(drawing)
    drawing.line([frame.at(0.0, 0.0), frame.at(LAGS, 0.0)], INK, 0.6)
    shown = dict.fromkeys((0, len(blocks) - 1))
    for revision, shift in zip(shown, (-0.15, 0.15), strict=False):
        left = blocks[revision].residual[:, k]
        left = left[np.isfinite(left)]
        if len(left) <= LAGS or not np.ptp(left) > 0.0:
            continue
        found = autocorrelation(left, LAGS)
        for lag, value in zip(found.lags[1:], found.values[1:]):
            stem = [frame.at(lag + shift, 0.0), frame.at(lag + shift, max(float(value), -0.5))]
            drawing.line(stem, revision_color(revision), 1.0)
        for limit in (-found.limit(0.95), found.limit(0.95)):
            drawing.line([frame.at(0.0, limit), frame.at(LAGS, limit)], FLOOR, 0.6)
    drawing.text((0.52, 1.05), "auto-correlation, lag in samples", FLOOR)
    return drawing


def revision_views(cast: Cast) -> list[rrb.View]:
    """For each output: measured and revisions; what they leave; its auto-correlation."""
    part = WHOLE if cast.revisions_whole else SO_FAR
    found: list[rrb.View] = []
    for body, unit in cast.outputs:
        shown = cast.shown(unit).unit
        quantity = "force" if unit == "N" else "acceleration"
        found += [
            _plot(path("revision", body), part, f"{body}: {quantity}, {shown}"),
            _plot(path("left", body), part, f"{body}: what is left, with the noise's 99 % band, {shown}"),
            view(path("whiteness", body), f"{body}: whiteness", 1.0, 1.07, -0.14),
        ]
    return found


def _plot(origin: str, part: str, name: str) -> rrb.View:
    """Without a legend, which would hide the curves: the key is beside the errors."""
    return rrb.TimeSeriesView(
        origin=origin,
        contents=f"$origin/{part}/**",
        name=name,
        axis_x=rrb.TimeAxis(link="LinkToGlobal"),
        plot_legend=rrb.PlotLegend(visible=False),
    )
