"""The selection from where the motion begins, where a stated time zero may be what is wrong."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from crash_replay.onset import AS_WELL
from crash_replay.recording import Recording

from ...effects.effect import Effect
from ...structure import Structure
from ..observation.pace import at_its_own_pace
from ..observation.record import ObservedRecord, observe
from ..observation.rest import rests_of
from ..output_error.gauss_newton import fit
from ..output_error.problem import make_problem
from ..parameterization.magnitudes import measure_magnitudes
from ..parameterization.model_terms import additions_of
from ..parameterization.nuisances import FARTHEST
from ..residuals.residuals import Residuals, analyse
from .acceptance import cost_of_noise, share_removed
from .assumptions import as_given, select
from .candidate_fits import begin
from .fitted_model import Model, fit_model
from .forward_selection import first_step
from .rare_effects import common_effects
from .search_limit import half_of_what_is_left, search_is_over
from .selection_path import SelectionPath, first_believed
from .thresholds import THRESHOLDS
from .time_zero import Shift, TimeZero, coasting, moved_by, onsets, touching

HALF_AS_FAR = 0.5 * AS_WELL**0.5
"""Standard deviations of an onset off the stated time zero, though by less than is told, from which on bodies may touch
elsewhere. In the two looked-at tests that it was made for the farther onset is 2.8 and 2.9 of them off."""


class Begun(NamedTuple):
    """What a selection has found, and from which time zeros."""

    path: SelectionPath
    zero: TimeZero | None = None  # what is told of them; None: nothing
    unused: tuple[Shift, ...] = ()  # onsets that are elsewhere, and that no recording is taken from
    taken: tuple[Shift, ...] = ()  # onsets that recordings are taken from, though from there no less is left


def select_from_the_onset(
    structure: Structure, recordings: Sequence[Recording], effects: Mapping[str, Effect]
) -> Begun:
    """What a structure lacks, from the stated time zeros on, or from where its motion begins, where that leaves less.

    Raises ModelError or RecordingError where the data or the model is at fault.
    """
    return _with_a_step_that_helps(_Search(structure, recordings, effects).begun())


def model_as_stated(
    structure: Structure, recordings: Sequence[Recording], effects: Mapping[str, Effect], hopeless: float = np.inf
) -> Model:
    """The structure as given, fitted once, from the stated time zeros on; hopeless: as of `fit_model`."""
    records = _Search(structure, recordings, effects).as_stated
    magnitudes = measure_magnitudes(structure, records)
    return fit_model(magnitudes, records, additions_of(magnitudes, effects), hopeless=hopeless)


@dataclass(frozen=True)
class _Search:
    structure: Structure
    recordings: Sequence[Recording]
    effects: Mapping[str, Effect]

    def begun(self) -> Begun:
        """From where bodies touch, where that explains what no effect does from the stated time zeros on; else as
        stated, or from an onset before that; or from where bodies touch after all, where that is better."""
        elsewhere = tuple(shift for shift in self.begins if shift.differs)
        early = tuple(shift for shift in elsewhere if shift.off(0.0) > 0.0)
        zero = touched = None
        searched = False  # all of it, while it is open when bodies touch
        if any(shift.off(0.0) for shift in elsewhere):
            magnitudes, given = as_given(self.structure, self.as_stated, self.effects)
            zero = self._begins_early(given, early) if early else None
            searched = not given.white and self._may_be_explained_open()
            if searched and len(self.in_doubt.added) <= 1 and _leaves_about_noise(self.in_doubt):
                if zero or not first_step(magnitudes, self.effects, given).leaves_noise:
                    touched = self._from_the_touch(given)
            if touched and (search_is_over() or _leaves_noise_with_few(touched)):
                return touched
        found = self._stated_or_early(zero, elsewhere)
        settled = touched or found.taken or search_is_over()
        if not settled and self._may_begin_elsewhere(found.path, elsewhere):
            if (searched or self._explained_by_the_touch(found.path)) and _better(self.in_doubt, found.path):
                touched = self._from_the_touch(zero.as_stated if zero else found.path.steps[0].before)
        return touched if touched and _better(touched.path, found.path) else found

    def _stated_or_early(self, zero: TimeZero | None, elsewhere: tuple[Shift, ...]) -> Begun:
        """From onsets that come before the stated time zeros, unless what is found from these leaves noise and that
        does not; without any from the stated ones on."""
        if zero:
            others = tuple(shift for shift in elsewhere if shift not in zero.shifts)
            early = Begun(self._selected(self._observed(zero.shifts)), zero, others)
            if early.path.noise or search_is_over():
                return early
        stated = Begun(self._selected(self.as_stated), None, elsewhere)
        if stated.path.noise:
            return stated
        return early if zero else self._all_of_the_motion(stated, elsewhere)

    def _all_of_the_motion(self, stated: Begun, elsewhere: tuple[Shift, ...]) -> Begun:
        """From onsets that come before the stated time zeros beyond doubt, where from there on no more is left than
        from these: where the crush is measured it makes no difference to what is compared anyway, and how it begins,
        with the highest rates, is compared as well. Of 23 looked-at recordings of a real impactor that begin early the
        model found from there on is -0.6 to 13.1 nats ahead."""
        taken = tuple(shift for shift in elsewhere if shift.off(0.0) > FARTHEST * shift.impact[1])
        if not taken or search_is_over():
            return stated
        path = self._selected(self._observed(taken))
        as_well = TimeZero(taken, stated.path.final).gain(path.final) > -THRESHOLDS.gain
        unused = tuple(shift for shift in elsewhere if shift not in taken)
        return Begun(path, None, unused, taken) if as_well else stated

    def _begins_early(self, given: Model, early: tuple[Shift, ...]) -> TimeZero | None:
        """None where the model as given leaves noise only, or hardly less from the onsets on."""
        if given.white:
            return None
        _, moved = as_given(self.structure, self._observed(early), self.effects)
        zero = TimeZero(early, given)
        return zero if zero.gain(moved) > THRESHOLDS.gain else None

    @cached_property
    def begins(self) -> tuple[Shift, ...]:
        """Onsets of the recordings that rest before them, wherever these are; none where measured forces push all free
        bodies, which say themselves when."""
        free = [body for body in self.structure.bodies if body.free]
        if free and all(body.applied for body in free):
            return ()
        return tuple(one._replace(early=self.as_stated[one.recording].onset_early) for one in onsets(self.recordings))

    @cached_property
    def as_stated(self) -> list[ObservedRecord]:
        """From the stated time zeros on."""
        return self._observed()

    @cached_property
    def coasting_records(self) -> list[ObservedRecord]:
        """From before bodies may touch, and open when they do."""
        by = {shift.recording: shift for shift in self.begins}
        moved = [coasting(one, by[k]) if k in by else one for k, one in enumerate(self.recordings)]
        records = self._at_rest_before(moved)
        stds = [by[k].impact[1] if k in by else 0.0 for k in range(len(moved))]
        return [one._replace(impact_std=std) for one, std in zip(records, stds, strict=True)]

    @cached_property
    def in_doubt(self) -> SelectionPath:
        """What is found while it is open when bodies touch."""
        with half_of_what_is_left():
            return self._selected(self.coasting_records)

    def _may_be_explained_open(self) -> bool:
        """Whether one of the likeliest additions leaves less than a real structure does of any model, while it is open
        when bodies touch."""
        records = self.coasting_records
        magnitudes = measure_magnitudes(self.structure, records)
        given = fit_model(magnitudes, records, additions_of(magnitudes, self.effects))
        most = THRESHOLDS.real_structure * cost_of_noise(records)
        likely = common_effects(self.structure, self.effects)
        return given.fit.cost < most or begin(magnitudes, likely, given).least < most

    def _explained_by_the_touch(self, path: SelectionPath) -> bool:
        """Whether about noise is left, or next to nothing of what is left so far, while it is open when bodies touch,
        by the model as given, by what was found, or with one of the best first candidates. Of 15 looked-at searches the
        three that were right were of such."""
        first = path.steps[0]
        fitted = [one for one in first.as_recorded if one.fit][: THRESHOLDS.shortlist]
        given = first.before.additions
        likely = ((*given, one.addition) for one in (*fitted, *first.doubted[: THRESHOLDS.few]))
        models = (given, path.final.additions, *likely)
        magnitudes = measure_magnitudes(path.structure, self.coasting_records, path.cells)
        next_to_nothing = (1.0 - THRESHOLDS.nearly_all) * path.as_recorded.cost
        most = max(THRESHOLDS.near_floor * cost_of_noise(self.coasting_records), next_to_nothing)
        problems = (make_problem(magnitudes, self.coasting_records, additions) for additions in models)
        return any(fit(problem, hopeless=most).cost < most for problem in problems)

    def _from_the_touch(self, as_stated: Model) -> Begun | None:
        """From where bodies touch; None where what moves would be left out, or no less is left than from the stated
        time zeros on."""
        there = tuple(touching(shift, self.in_doubt.as_recorded) for shift in self.begins)
        if search_is_over() or not self._rest_until(there):
            return None
        elsewhere = tuple(shift for shift in there if abs(shift.seconds) > max(AS_WELL**0.5 * shift.std, shift.period))
        path, zero = self._selected(self._observed(there)), TimeZero(elsewhere, as_stated)
        return Begun(path, zero) if elsewhere and zero.gain(path.final) > THRESHOLDS.gain else None

    def _may_begin_elsewhere(self, path: SelectionPath, elsewhere: Sequence[Shift]) -> bool:
        """Where something is left, or several effects may make up for it, as channels that are all late do for a time
        zero that is early, however gently the motion rises out of the noise."""
        hidden = (one.early or abs(one.seconds) > HALF_AS_FAR * one.impact[1] for one in self.begins)
        if not (elsewhere or any(hidden)):
            return False
        if not elsewhere and _left_by(path).mean_square >= THRESHOLDS.real_structure:
            return False
        several = len(path.added) > 1 and (elsewhere or all(one.effect.distorts == "delay" for one in path.added))
        return not path.noise or bool(several)

    def _rest_until(self, shifts: Sequence[Shift]) -> bool:
        """Whether the signals rest from the stated time zeros until then, or until a filter may show what comes: what
        moves is not to be left out."""
        for shift in shifts:
            record = self.as_stated[shift.recording]
            before = record.measured[record.time[record.at] < shift.seconds - shift.early]
            if len(before) and np.isfinite(before).any(axis=0).all():
                std = np.hypot(record.noise / np.sqrt(len(before)), record.offset_std)
                if (np.abs(np.nanmean(before, axis=0)) > FARTHEST * std).any():
                    return False
        return True

    def _selected(self, records: Sequence[ObservedRecord]) -> SelectionPath:
        return first_believed(select(self.structure, records, self.effects))

    def _observed(self, shifts: Sequence[Shift] = ()) -> list[ObservedRecord]:
        return self._at_rest_before(moved_by(shifts, self.recordings))

    def _at_rest_before(self, recordings: Sequence[Recording]) -> list[ObservedRecord]:
        """Their time zero."""
        moved = [at_its_own_pace(self.structure, one) for one in recordings]
        return [observe(self.structure, *each) for each in zip(moved, rests_of(moved), strict=True)]


def _with_a_step_that_helps(begun: Begun) -> Begun:
    """Where the model as given leaves more from the onset on, and what was found with that leaves more than noise, no
    error of the time zero is told; that the recordings are taken from there still is."""
    path, zero = begun.path, begun.zero
    if not zero or path.noise or zero.gain(path.steps[0].sized) > 0.0:
        return begun
    return begun._replace(zero=None, taken=zero.shifts)


def _leaves_noise_with_few(begun: Begun) -> bool:
    """With no more than are believed together, its time zero counted: bodies apart at first may also have a gap."""
    return begun.path.noise and len(begun.path.added) < THRESHOLDS.most_at_once


def _left_by(path: SelectionPath) -> Residuals:
    """In the sensors' noise."""
    return analyse(path.as_recorded)


def _leaves_about_noise(path: SelectionPath) -> bool:
    return path.noise or _left_by(path).mean_square < THRESHOLDS.near_floor


def _better(one: SelectionPath, other: SelectionPath) -> bool:
    """It alone leaves noise, or with fewer effects; or, where both leave more, much less with as many: of so much more
    that a real structure may leave it of any lumped model, next to none."""
    if one.noise or other.noise:
        return one.noise and (not other.noise or len(one.added) < len(other.added))
    if other.final.white:  # what varies with time in what looks like noise is no matter of when that begins
        return False
    left = _left_by(other)
    least = THRESHOLDS.nearly_all if left.mean_square >= THRESHOLDS.real_structure else THRESHOLDS.some
    return len(one.added) <= max(len(other.added), 1) and share_removed(left, _left_by(one)) > least
