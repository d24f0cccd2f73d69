"""Rare effects bend far: they are looked for after the common ones, and believed only where one of them alone leaves
noise."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ...effects.effect import Effect
from ...structure import Structure
from ..observation.record import ObservedRecord
from ..parameterization.magnitudes import measure_magnitudes
from .assumptions import SelectionPath, first_believed, select
from .candidate_fits import fit_candidates
from .fitted_model import fit_model
from .selection_step import SelectionStep
from .thresholds import THRESHOLDS
from .time_limit import out_of_time


def common_effects(structure: Structure, effects: Mapping[str, Effect]) -> Mapping[str, Effect]:
    """Those that are looked for first; what the model has already is one of them."""
    has = {spec.type for spec in structure.effects}
    found = {name: effect if name in has else effect.common() for name, effect in effects.items()}
    return {name: effect for name, effect in found.items() if effect}


def select_common_first(
    structure: Structure, records: Sequence[ObservedRecord], effects: Mapping[str, Effect],
    enough: Callable[[SelectionPath], bool],
) -> SelectionPath:  # fmt: skip
    """The effects that a structure lacks: the common ones, or those with rare ones among them that leave noise and are
    as likely: then both stand in one ranking.

    enough: whether what the common ones leave is good enough, so that none is looked for beside them. Whether a rare
    one leaves noise, alone, is asked first; only then is it set against all the others.
    """
    common = common_effects(structure, effects)
    found = first_believed(select(structure, records, common))
    if common == effects or enough(found):
        return found
    rare = {name: effect for name, effect in effects.items() if effect != common.get(name)}
    if not _one_leaves_noise(rare, found):
        return found
    path = first_believed(select(structure, records, effects))
    return found if out_of_time() or not _is_as_good(path, found) else path


def _one_leaves_noise(rare: Mapping[str, Effect], found: SelectionPath) -> bool:
    """Whether one of them does, alone. It is fitted with care where it leaves less than what was found."""
    magnitudes, other = measure_magnitudes(found.structure, found.records, found.cells), found.as_recorded.cost
    model = fit_model(magnitudes, found.records, found.final.additions[: found.present])
    if model.white or out_of_time():
        return False
    fits = fit_candidates(magnitudes, rare, model, least=other)
    step = SelectionStep(model, fits)
    if not step.leaves_noise and any(one.fit and one.fit.cost < other for one in fits):
        step = SelectionStep(model, fit_candidates(magnitudes, rare, model, thorough=True, least=other))
    return step.leaves_noise


def _is_as_good(path: SelectionPath, found: SelectionPath) -> bool:
    """One effect alone leaves noise in the whole band, as the other path does not, or is not less likely beyond doubt.
    A rare one with another beside it would follow most that no vocabulary has."""
    as_likely = path.as_recorded.evidence > found.as_recorded.evidence - THRESHOLDS.confounded
    return len(path.added) == 1 and _leaves_noise(path) and (as_likely or not _leaves_noise(found))


def _leaves_noise(path: SelectionPath) -> bool:
    return path.final.white and all(np.isinf(record.below) for record in path.records)
