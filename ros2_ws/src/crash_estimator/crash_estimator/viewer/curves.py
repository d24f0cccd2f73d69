"""Time plots: measured against predicted, residual and innovation with their 99 % band, parameters with +- sigma."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from .blocks import ParameterBlock, ResidualBlock
from .cast import MEASURED, Cast
from .pen import Pen, path
from .plausible import Limits

BAND = 2.576
"""Standard deviations on each side that hold 99 % of a normal distribution."""


class Curves:
    """Writes the time plots of all estimators into one recording."""

    def __init__(self, pen: Pen):
        self.pen = pen
        self.limits = Limits()
        self.measured_until: dict[str, int] = {}  # ns; a measurement is the same for all estimators, drawn once

    def write_residuals(self, cast: Cast, block: ResidualBlock) -> None:
        color, label = cast.color(block.estimator), cast.label(block.estimator)
        for k, (body, si_unit) in enumerate(zip(block.name, block.unit, strict=True)):
            factor = cast.shown(si_unit).factor
            self._measured(path("signal", body), block.time_ns, factor * block.measured[:, k])
            predicted = path("signal", body, "model", block.estimator)
            self.pen.curve(predicted, block.time_ns, factor * self.limits.predicted(block, k), label, color, 1.5)
            for kind, values, std in (
                ("residual", block.residual, block.residual_std),
                ("innovation", block.innovation, block.innovation_std),
            ):
                line = path(kind, body, block.estimator)
                band = path(kind, body, "band", block.estimator)
                half_width = BAND * factor * std[:, k]
                zero = np.zeros(len(block.time_ns))
                self.pen.band(band, block.time_ns, zero, half_width, label, color, 0.5)
                self.pen.curve(line, block.time_ns, factor * values[:, k], label, color, 1.0)

    def _measured(self, signal: str, time_ns: np.ndarray, values: np.ndarray) -> None:
        new = time_ns > self.measured_until.get(signal, np.iinfo(np.int64).min)
        if new.any():
            self.measured_until[signal] = int(time_ns[-1])
            self.pen.curve(f"{signal}/measured", time_ns[new], values[new], "measured", MEASURED, 3.0)

    def write_parameters(self, cast: Cast, block: ParameterBlock) -> None:
        color, label = cast.color(block.estimator), cast.label(block.estimator)
        drawn = [name for name, _ in cast.member(block.estimator).parameters]
        for k, (name, si_unit) in enumerate(zip(block.name, block.unit, strict=True)):
            if name in drawn:
                factor = cast.shown(si_unit).factor
                line = path("parameter", name, block.estimator)
                value, std = factor * self.limits.parameter(block, k), factor * block.std[:, k]
                self.pen.band(line, block.time_ns, value, std, label, color, 1.5)


def signal_views(cast: Cast) -> list[rrb.View]:
    """Measured and every model's prediction, one plot for each equation."""
    return [
        _plot(path("signal", body), f"{body}: {_quantity(unit)}, {cast.shown(unit).unit}", quiet_corner(cast, body))
        for body, unit in cast.equations
    ]


def residual_views(cast: Cast, kind: str = "residual") -> list[rrb.View]:
    """kind: `residual` (after the update) or `innovation` (before it)."""
    return [
        _plot(path(kind, body), f"{body}: {kind} and its 99 % band, {cast.shown(unit).unit}")
        for body, unit in cast.equations
    ]


def parameter_views(cast: Cast) -> list[rrb.View]:
    """Each parameter of any model with all estimators of it."""
    corner = rrb.Corner2D.LeftTop  # before the impact, where it is not known yet
    return [
        _plot(path("parameter", name), f"{name} and its ± σ band, {cast.shown(unit).unit}", corner)
        for name, unit in cast.parameters
    ]


def framed(views: list[rrb.View], cast: Cast) -> list[rrb.View]:
    """The same plots small: no legends that hide curves, and the whole recording as a time axis that stands still."""
    start, end = cast.span
    start = max(start, -0.1 * end) if end > 0 else start  # the quiet before the impact needs little room
    for view in views:
        view.properties["TimeAxis"] = rrb.TimeAxis(
            view_range=rr.TimeRange(
                start=rrb.TimeRangeBoundary.absolute(seconds=start), end=rrb.TimeRangeBoundary.absolute(seconds=end)
            )
        )
        view.properties["PlotLegend"] = rrb.PlotLegend(visible=False)
    return views


def quiet_corner(cast: Cast, body: str) -> rrb.Corner2D:
    """A corner for the legend that the curve leaves free: what strikes slows down, what is struck is pushed forward."""
    pushed = {b for m in cast.members for _, b in m.between}
    return rrb.Corner2D.RightTop if body in pushed else rrb.Corner2D.RightBottom


def _plot(origin: str, name: str, corner: rrb.Corner2D = rrb.Corner2D.RightTop) -> rrb.View:
    """Time axes of such plots are linked: who zooms one, zooms all."""
    return rrb.TimeSeriesView(
        origin=origin, name=name, axis_x=rrb.TimeAxis(link="LinkToGlobal"), plot_legend=rrb.PlotLegend(corner)
    )


def _quantity(unit: str) -> str:
    return "force" if unit == "N" else "acceleration"
