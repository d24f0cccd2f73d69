"""What the diagnosis says, on the screen: the ranking, each revision's curves and error, and where the model fails."""

from dataclasses import replace

import rerun.blueprint as rrb

from .cast import Cast
from .findings import Finding, MisfitBlock, RankingBlock, RevisionBlock
from .pen import Pen
from .ranking import error_view, ranking_drawing, ranking_path, ranking_view
from .revisions import Revisions, revision_views

MOST_OUTPUTS = 3
"""Rows of plots on one tab."""


class Missing:
    """Writes findings into one recording."""

    def __init__(self, pen: Pen):
        self.pen, self.revisions = pen, Revisions(pen)

    def write(self, cast: Cast, finding: Finding) -> None:
        match finding:
            case RankingBlock():
                entity = ranking_path(finding.revision)
                ranking_drawing(finding).write(self.pen, entity, round(1e9 * finding.time))
                self.revisions.write_ranking(cast, finding)
            case RevisionBlock():
                self.revisions.write_revision(cast, finding)
            case MisfitBlock():
                self.revisions.write_misfit(cast, finding)

    def finish(self) -> None:
        self.revisions.finish()


def cast_with(cast: Cast, finding: Finding) -> Cast:
    """The cast as a finding makes it: a tab of its own from the first one on, plots once there are revisions."""
    if isinstance(finding, RankingBlock) and finding.revision not in cast.rankings:
        return replace(cast, rankings=cast.rankings + (finding.revision,))
    if isinstance(finding, RevisionBlock):
        outputs = tuple(zip(finding.name, finding.unit))
        cast = replace(cast, outputs=outputs, revisions_whole=cast.revisions_whole or finding.final)
    return cast


def missing_tab(cast: Cast) -> rrb.Container:
    """Ranking and error at the left; at the right a row of plots for each output."""
    views = revision_views(cast)
    rows = [rrb.Horizontal(*views[k : k + 3], column_shares=[6, 6, 3]) for k in range(0, len(views), 3)]
    rankings = rrb.Tabs(*(ranking_view(revision) for revision in cast.rankings), active_tab=0)
    left = rrb.Vertical(rankings, error_view(), row_shares=[10, 7])
    if not rows:
        return rrb.Horizontal(left, name="Missing effect")
    right = rrb.Vertical(*rows[:MOST_OUTPUTS])
    return rrb.Horizontal(left, right, column_shares=[3, 8], name="Missing effect")
