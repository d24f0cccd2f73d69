"""What a selection has found, from the first addition to the last, and under which assumptions."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...effects.effect import Addition
from ...structure import Structure
from ..observation.record import ObservedRecord
from ..output_error.gauss_newton import Fit, fit
from ..residuals.score_test import drift_of
from .acceptance import share_removed
from .fitted_model import Model
from .selection_step import SelectionStep
from .thresholds import THRESHOLDS
from .time_varying import Varying


class SelectionPath(NamedTuple):
    """What a selection has found."""

    structure: Structure  # as it was assumed
    steps: list[SelectionStep]
    final: Model
    as_recorded: Fit  # of the final model, in the sensors' noise
    records: Sequence[ObservedRecord]  # in the band that was compared
    cells: int  # of the final model's curves
    whole: bool = True  # False: it ends before its first addition, as other assumptions promise more
    varying: Varying | None = None  # what may vary with time instead, of the model as given

    @property
    def given_up(self) -> bool:
        """Before its first addition, for what varies with time."""
        return bool(self.whole and self.varying and not self.added)

    @property
    def rival_in_time(self) -> Varying | None:
        """It, where what was found is not likelier, near the noise, or leaves much more: neither is told then."""
        found, varying = self.as_recorded, self.varying
        if varying is None:
            return None
        if self.final.residuals.mean_square >= THRESHOLDS.near_floor:
            return varying if varying.leaves_much_less([found]) else None
        return varying if varying.fit.evidence > found.evidence - THRESHOLDS.gain else None

    @property
    def noise(self) -> bool:
        """The final model leaves nothing else, and nothing that varies with time."""
        return self.final.white and drift_of(self.as_recorded).constant

    @property
    def added(self) -> Sequence[Addition]:
        return self.final.found

    @property
    def least_cost(self) -> float:
        """Of all that was fitted, in the sensors' noise."""
        return min(self.furthest.cost, self.varying.fit.cost if self.varying else np.inf)

    @property
    def furthest(self) -> Fit:
        """In the sensors' noise: of the final model, or of the best first candidate where none was added yet."""
        best = None if self.whole else self.steps[0].best
        return best.fit if best else self.as_recorded

    def rank(self) -> tuple[bool, bool, float]:
        """Of paths under different assumptions the largest is believed."""
        return self.final.white, self.whole, self.furthest.evidence


def first_believed(path: SelectionPath) -> SelectionPath:
    """Up to as many additions as are believed together, where all of them leave more than noise, or where these leave
    next to nothing: the first ones explain most, and what came after them only goes on from there."""
    most = THRESHOLDS.most_at_once
    if len(path.added) <= most:
        return path
    final = path.steps[most].before
    if path.final.white and share_removed(path.steps[0].before.residuals, final.residuals) < THRESHOLDS.nearly_all:
        return path
    return up_to(path, most)


def up_to(path: SelectionPath, count: int) -> SelectionPath:
    """With the first of its additions only."""
    steps = path.steps[: count + 1]
    final = steps[-1].before
    as_recorded = in_the_sensors_noise(steps[-1].sized, path.records)
    return path._replace(steps=steps, final=final, as_recorded=as_recorded)


def in_the_sensors_noise(model: Model, records: Sequence[ObservedRecord]) -> Fit:
    """The model's fit; made again where that was in a larger noise."""
    problem = model.fit.problem
    return fit(problem.on(records), model.fit.point) if problem.noise_is_inflated else model.fit
