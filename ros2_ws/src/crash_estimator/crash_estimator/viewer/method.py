"""What a method knows besides the model's parameters: weights of a bank's models, a noise model's coefficients."""

import numpy as np
import rerun.blueprint as rrb

from ..core.estimate import ParameterStatus
from .blocks import ParameterBlock
from .cast import Cast
from .colors import ESTIMATOR_COLORS
from .pen import Look, Pen, path

MOMENT = "s"
"""Unit of a moment, such as a model's last jump: events tell of it."""


def write(pen: Pen, block: ParameterBlock) -> None:
    """One plot for each kind of quantity: all weights together, all "ar" coefficients together."""
    for k, (name, unit) in enumerate(zip(block.name, block.unit)):
        if block.status[0, k] == ParameterStatus.METHOD and unit != MOMENT:
            color = ESTIMATOR_COLORS[_place(block, name) % len(ESTIMATOR_COLORS)]
            value, std = block.value[:, k], block.std[:, k]
            entity = path("method", block.estimator, kind(name), name)
            if np.isfinite(std).any():
                pen.band(entity, block.time_ns, value, std, Look(name, color), 1.5)
            else:
                pen.curve(entity, block.time_ns, value, Look(name, color), 1.5)


def _place(block: ParameterBlock, name: str) -> int:
    return [other for other in block.name if kind(other) == kind(name)].index(name)


def kind(name: str) -> str:
    """ "weight" of "model0.weight", "ar" of "car.ar1"."""
    return name.rpartition(".")[2].rstrip("0123456789")


def method_tab(cast: Cast) -> rrb.Container:
    views = [
        rrb.TimeSeriesView(
            origin=path("method", m.name, what), name=f"{cast.label(m.name)}: {what}",
            axis_x=rrb.TimeAxis(link="LinkToGlobal"), plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop),
        )
        for m in cast.members
        for what in dict.fromkeys(kind(name) for name, unit in m.besides if unit != MOMENT)
    ]  # fmt: skip
    return rrb.Grid(*views, name="Method")
