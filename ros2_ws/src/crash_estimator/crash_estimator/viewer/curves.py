"""Time plots: measured against predicted, residual and innovation over the noise's band, parameters with +- sigma."""

import numpy as np
import rerun.blueprint as rrb

from .blocks import ParameterBlock, ResidualBlock
from .cast import Cast
from .colors import MEASURED
from .noise import NoiseFloor
from .pen import Look, Pen, own_path, path
from .plausible import Limits

BAND = 2.576
"""Standard deviations on each side that hold 99 % of a normal distribution."""
NOISE = Look("noise, 99 %", MEASURED)
SO_FAR, WHOLE = "so_far", "whole"
"""Parts of an entity's path: what was known while samples came, and after the last one."""


class Curves:
    """Writes the time plots of all members into one recording."""

    def __init__(self, pen: Pen):
        self.pen = pen
        self.limits = Limits()
        self.noise = NoiseFloor()
        self.measured_until: dict[str, int] = {}  # ns; a measurement is the same for all estimators, drawn once

    def write_residuals(self, cast: Cast, block: ResidualBlock) -> None:
        who = block.estimator
        for k, (body, si_unit) in enumerate(zip(block.name, block.unit)):
            factor = cast.shown(si_unit).factor
            self._measured(body, block.time_ns, block.measured[:, k], factor)
            predicted = factor * self.limits.predicted(block, k)
            self.pen.curve(own_path("signal", body, who=who), block.time_ns, predicted, Look(of=who), 1.5)
            for kind, values in (("residual", block.residual), ("innovation", block.innovation)):
                line = own_path(kind, body, who=who)
                self.pen.curve(line, block.time_ns, factor * values[:, k], Look(of=who), 1.0)

    def _measured(self, body: str, time_ns: np.ndarray, values: np.ndarray, factor: float) -> None:
        """The measurement, and how much of it is noise: what a model leaves beyond that band is its failure."""
        signal = path("signal", body)
        new = time_ns > self.measured_until.get(signal, np.iinfo(np.int64).min)
        if new.any():
            self.measured_until[signal] = int(time_ns[-1])
            time_ns, values = time_ns[new], values[new]
            self.pen.curve(f"{signal}/measured", time_ns, factor * values, Look("measured", MEASURED), 3.0)
            self._band(SO_FAR, body, time_ns[[0, -1]], factor * self.noise.hear(body, time_ns, values))

    def _band(self, part: str, body: str, time_ns: np.ndarray, std: float) -> None:
        zero = np.zeros(len(time_ns))
        for kind in ("residual", "innovation"):
            self.pen.band(path(kind, body, "band", part), time_ns, zero, zero + BAND * std, NOISE, 0.5)

    def finish(self, cast: Cast) -> None:
        """The bands from all samples, one from end to end."""
        units = dict(cast.equations)
        for body, time_ns in self.noise.spans().items():
            self._band(WHOLE, body, time_ns, cast.shown(units[body]).factor * self.noise.of_all(body))

    def write_parameters(self, cast: Cast, block: ParameterBlock) -> None:
        who = block.estimator
        drawn = [name for name, _ in cast.member(who).parameters]
        for k, (name, si_unit) in enumerate(zip(block.name, block.unit)):
            if name in drawn:
                factor = cast.shown(si_unit).factor
                value, std = factor * self.limits.parameter(block, k), factor * block.std[:, k]
                line = own_path("parameter", name, who=who)
                self.pen.band(line, block.time_ns, value, std, Look(of=who), 1.5)


def signal_views(cast: Cast) -> list[rrb.View]:
    """Measured and every model's prediction, one plot for each equation."""
    return [
        _plot(path("signal", body), f"{body}: {_quantity(unit)}, {cast.shown(unit).unit}", quiet_corner(cast, body))
        for body, unit in cast.equations
    ]


def residual_views(cast: Cast, kind: str = "residual") -> list[rrb.View]:
    """kind: `residual` (after the update) or `innovation` (before it)."""
    other = SO_FAR if cast.whole else WHOLE
    return [
        _plot(
            path(kind, body), f"{body}: {kind}, with the noise's 99 % band, {cast.shown(unit).unit}",
            rrb.Corner2D.LeftTop, hidden=other,
        )
        for body, unit in cast.equations
    ]  # fmt: skip


def parameter_views(cast: Cast) -> list[rrb.View]:
    """Each parameter of any model with all members that estimate it."""
    corner = rrb.Corner2D.LeftTop  # before the impact, where it is not known yet
    return [
        _plot(path("parameter", name), f"{name} and its ± σ band, {cast.shown(unit).unit}", corner)
        for name, unit in cast.parameters
    ]


def quiet_corner(cast: Cast, body: str) -> rrb.Corner2D:
    """A corner for the legend that the curve leaves free: what strikes slows down, what is struck is pushed forward."""
    pushed = {b for m in cast.members for _, b in m.between}
    return rrb.Corner2D.RightTop if body in pushed else rrb.Corner2D.RightBottom


def early_corner(cast: Cast, body: str) -> rrb.Corner2D:
    """At the left, where the curve still is near zero."""
    pushed = quiet_corner(cast, body) == rrb.Corner2D.RightTop
    return rrb.Corner2D.LeftTop if pushed else rrb.Corner2D.LeftBottom


def _plot(origin: str, name: str, corner: rrb.Corner2D = rrb.Corner2D.RightTop, hidden: str = "") -> rrb.View:
    """Time axes of such plots are linked: who zooms one, zooms all. hidden: a part of the band that is not shown."""
    return rrb.TimeSeriesView(
        origin=origin,
        contents=["+ $origin/**", *([f"- $origin/band/{hidden}"] if hidden else [])],
        name=name,
        axis_x=rrb.TimeAxis(link="LinkToGlobal"),
        plot_legend=rrb.PlotLegend(corner),
    )


def _quantity(unit: str) -> str:
    return "force" if unit == "N" else "acceleration"
