"""The layout, sent before the data: a table of tabs, each made from the cast.

A new kind of picture is a writer in `show.py` and a tab, or a view in one, here.
"""

from collections.abc import Callable
from itertools import zip_longest

import rerun.blueprint as rrb

from .cast import Cast
from .curves import parameter_views, residual_views, signal_views
from .loops import loop_views
from .method import method_tab
from .missing import missing_tab
from .motion import motion_view
from .pen import TIMELINE
from .states import event_view, state_view
from .states import lanes as state_lanes
from .summary import summary_view
from .validation import validation_tab

MOST_EQUATIONS = 4
"""In the overview."""


def overview(cast: Cast) -> rrb.Container:
    """Everything at a glance: the figure above two loops; beside them four equations."""
    signals = signal_views(cast)[:MOST_EQUATIONS]
    for view in signals:
        view.name = f"{view.name} (grey: measured)"  # the other colours stand beside the figure and the loops
        view.properties["PlotLegend"] = rrb.PlotLegend(visible=False)
    return rrb.Horizontal(
        rrb.Vertical(
            rrb.Tabs(motion_view(cast), summary_view(), event_view()),
            rrb.Horizontal(*loop_views(cast, first_elements(cast)[:2])),
            row_shares=[11, 10],
        ),
        rrb.Vertical(*signals),
        name="Overview",
    )


def signals(cast: Cast) -> rrb.Container:
    return rrb.Vertical(*signal_views(cast), name="Measured and model")


def residuals(cast: Cast) -> rrb.Container:
    return rrb.Horizontal(
        rrb.Vertical(*residual_views(cast, "innovation")), rrb.Vertical(*residual_views(cast)), name="Residuals"
    )


def parameters(cast: Cast) -> rrb.Container:
    views = parameter_views(cast)
    plots = rrb.Vertical(*views) if len(views) <= 3 else rrb.Grid(*views, grid_columns=2)
    return rrb.Vertical(plots, state_view(cast), row_shares=_above_lanes(cast, most=0.38), name="Parameters")


def force_crush(cast: Cast) -> rrb.Container:
    views = loop_views(cast, cast.elements)
    columns = 2 if len(views) in (2, 4) else min(len(views), 3)
    return rrb.Grid(*views, grid_columns=columns, name="Force over crush")


def motion(cast: Cast) -> rrb.Container:
    return rrb.Vertical(
        motion_view(cast), state_view(cast), row_shares=_above_lanes(cast, most=0.45), name="Motion and states"
    )


def events(cast: Cast) -> rrb.Container:
    return rrb.Horizontal(event_view(), summary_view(), column_shares=[3, 2], name="Events")


TABS: tuple[Callable[[Cast], rrb.Container], ...] = (
    overview,
    signals,
    residuals,
    parameters,
    force_crush,
    motion,
    events,
)


def tabs(cast: Cast) -> list[rrb.Container]:
    """Those that there is something for: what is missing comes first where somebody looks for it."""
    every = [tab(cast) for tab in TABS] if cast.members else []
    every += [method_tab(cast)] if any(m.besides for m in cast.members) else []
    every += [validation_tab(cast)] if cast.judged else []
    return [missing_tab(cast), *every] if cast.rankings else every


def blueprint(cast: Cast, active_tab: int = 0) -> rrb.Blueprint:
    """All tabs, the first one on top; the time cursor follows the newest sample."""
    shown = tabs(cast)
    return rrb.Blueprint(
        rrb.Tabs(*shown, active_tab=active_tab if shown else None),  # none yet: a diagnosis came first
        rrb.TimePanel(timeline=TIMELINE, play_state="following", state="collapsed"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_layout=False,
        auto_views=False,
    )


def first_elements(cast: Cast) -> list[str]:
    """All elements, the first one of each estimator before the second ones."""
    taken_in_turn = zip_longest(*(m.elements for m in cast.members))
    return list(dict.fromkeys(name for turn in taken_in_turn for name in turn if name))


def _above_lanes(cast: Cast, most: float) -> list[float]:
    """Shares of a tab's height for what stands above the state lanes, and for the lanes, which get up to `most`."""
    lanes = min(0.1 + 0.035 * len(state_lanes(cast)), most)
    return [1 - lanes, lanes]
