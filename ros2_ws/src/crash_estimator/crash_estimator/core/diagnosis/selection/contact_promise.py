"""What contacts as they may be assumed otherwise promise of a selection: which of the models that it has fitted would
explain more under them."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import chain, islice

import numpy as np

from ...effects.effect import Addition
from ...structure import Structure
from ..observation.record import ObservedRecord
from ..output_error.continuation import SLOW_CONTACT
from ..output_error.gauss_newton import Fit, fit
from ..output_error.problem import make_problem
from ..parameterization.magnitudes import Magnitudes, measure_magnitudes
from .acceptance import cost_of_noise
from .contacts import moves_otherwise
from .fitted_model import forces_jump
from .selection_path import SelectionPath, in_the_sensors_noise
from .selection_step import models_of
from .thresholds import THRESHOLDS


def promised_by(other: Structure, path: SelectionPath, likely: Iterable[tuple[Sequence[Addition], Fit]]) -> float:
    """Nats: the evidence of what was found, under contacts as they are assumed otherwise; -inf where nothing is
    missing, where they would explain none of it, or less than what leaves noise already.

    Taken the wrong way, a damper that pulls looks like another effect. likely: the path's `likely_first`.
    """
    final, records = path.final, path.records
    if not path.added and final.white:
        return -np.inf
    magnitudes = measure_magnitudes(other, records, path.cells)
    found = ((model.additions, in_the_sensors_noise(model, records)) for model in models_of(path.steps, final))
    felt = ((additions, one) for additions, one in found if moves_otherwise(one, other))
    likely = ((additions, one) for additions, one in likely if moves_otherwise(one, other))
    first = max((one.fit.evidence for one in path.steps[0].as_recorded[:1] if one.fit), default=-np.inf)
    most, seen = -np.inf, set()
    for additions, as_recorded in chain(felt, islice(likely, THRESHOLDS.few)):
        what = frozenset((one.key, one.variant) for one in additions)
        if what in seen:
            continue
        seen.add(what)
        otherwise = _fitted_slowly(magnitudes, records, additions, path.least_cost + THRESHOLDS.hopeless)
        misfit = 0.5 * max(as_recorded.cost - cost_of_noise(records), 0.0)  # nats
        # what stays behind the best of all must gain most of what it lacked
        share = THRESHOLDS.some if otherwise.evidence > first else THRESHOLDS.half
        if otherwise.evidence > as_recorded.evidence + THRESHOLDS.gain + share * misfit:
            most = max(most, otherwise.evidence)
    if final.white and len(path.added) <= THRESHOLDS.most_at_once:
        return most if most > path.as_recorded.evidence else -np.inf
    return most if most > first or not path.whole else -np.inf


def _fitted_slowly(
    magnitudes: Magnitudes, records: Sequence[ObservedRecord], additions: Sequence[Addition], hopeless: float
) -> Fit:
    """With care for forces that jump at a contact; hopeless: as of `fit`."""
    problem = make_problem(magnitudes, records, additions)
    found = fit(problem, hopeless=hopeless)
    if not forces_jump(problem.layout):
        return found
    return max(found, fit(problem, found.point, SLOW_CONTACT, hopeless), key=lambda one: one.evidence)


def likely_first(path: SelectionPath) -> Iterator[tuple[Sequence[Addition], Fit]]:
    """The best first candidates, as another than the right one may have come first, in all their forms; where one
    leaves noise, those that explain nearly as much. Rare ones that leave less than all others, though not noise, as
    they may under contacts that are not so, are the first of them."""
    first = path.steps[0]
    magnitudes = measure_magnitudes(path.structure, path.records, path.cells)
    fitted = [*first.doubted, *(one for one in first.as_recorded if one.fit)]
    if path.final.white:
        fitted = [one for one in fitted if one.gain > (1.0 - THRESHOLDS.some) * fitted[0].gain]
    hopeless = path.least_cost + THRESHOLDS.hopeless
    for one in fitted:  # from where it began: what it has come to may be what made up for the contact
        yield (*first.before.additions, one.addition), one.fit
        for other in _in_other_forms(one.addition):
            additions = (*first.before.additions, other)
            yield additions, fit(make_problem(magnitudes, path.records, additions), hopeless=hopeless)


def _in_other_forms(addition: Addition) -> Iterator[Addition]:
    """With the same constants: the form that leaves least under some contacts may be another one than under others."""
    effect = addition.effect
    alike = (v for v in effect.variants if v != addition.variant and [*effect.shapes_of(v)] == [*addition.shapes])
    yield from (replace(addition, variant=variant) for variant in alike)
