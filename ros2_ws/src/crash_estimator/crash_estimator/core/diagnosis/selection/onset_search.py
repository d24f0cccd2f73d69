"""The selection from where the motion begins, where a stated time zero may be what is wrong."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from crash_replay.recording import Recording

from ...effects.effect import Addition, Effect
from ...structure import Structure
from ..observation.pace import at_its_own_pace
from ..observation.record import ObservedRecord, observe
from ..observation.rest import rests_of
from ..output_error.gauss_newton import fit
from ..output_error.problem import make_problem
from ..parameterization.magnitudes import measure_magnitudes
from ..residuals.residuals import Residuals, analyse
from .acceptance import share_removed
from .assumptions import SelectionPath, first_believed, select
from .candidates import candidates
from .fitted_model import Model, fit_model
from .rare_effects import common_effects
from .search_limit import search_is_over
from .selection_step import as_found
from .thresholds import THRESHOLDS
from .time_zero import FARTHEST, Shift, TimeZero, moved_by, onsets, sharpened, time_zero_wrong


class Begun(NamedTuple):
    """What a selection has found, and from which time zeros."""

    path: SelectionPath
    zero: TimeZero | None = None  # None: all as stated
    unused: tuple[Shift, ...] = ()  # onsets that are elsewhere, and that no recording is taken from


def select_from_the_onset(
    structure: Structure, recordings: Sequence[Recording], effects: Mapping[str, Effect]
) -> Begun:
    """What a structure lacks, from the stated time zeros on, or from where its motion begins, where that leaves less.

    Raises ModelError or RecordingError where the data or the model is at fault.
    """
    search = _Search(structure, recordings, effects)
    stated = search.from_early_onsets()
    return search.from_sharper_onsets(stated) or stated


@dataclass(frozen=True)
class _Search:
    structure: Structure
    recordings: Sequence[Recording]
    effects: Mapping[str, Effect]

    def from_early_onsets(self) -> Begun:
        """From the stated time zeros on, or from an onset where that comes first and the model leaves less so, unless
        what is found from the stated ones leaves noise and what is found from there does not."""
        records = self._observed()
        begins = onsets(self.recordings)
        elsewhere = tuple(shift._replace(early=records[shift.recording].seen_early) for shift in begins)
        early = tuple(shift for shift in elsewhere if shift.off(0.0) > 0.0)
        if early:
            from_onset, common = self._observed(early), common_effects(self.structure, self.effects)
            zero = time_zero_wrong(self.structure, records, from_onset, early, common)
            if zero:
                unused = tuple(shift for shift in elsewhere if shift not in early)
                found = Begun(self._selected(from_onset), zero, unused)
                if found.path.noise or search_is_over():
                    return found
                stated = self._selected(records)
                return Begun(stated, None, elsewhere) if stated.noise else found
        return Begun(self._selected(records), None, elsewhere)

    def from_sharper_onsets(self, found: Begun) -> Begun | None:
        """From the onsets, then from where the motion with the first effect that was found begins, then with another
        law in its place: the first that leaves noise, as what was found does not, or does with more effects; or else
        the one that leaves much less of more. Only from where next to nothing may be left. Channels that are all late
        are a time zero that is early, however gently the motion rises out of the noise."""
        path, zero, unused = found
        lacks_nothing = path.final.white and not (path.added or zero)
        several = len(path.added) > 1 and (unused or all(one.effect.distorts == "delay" for one in path.added))
        if lacks_nothing or (path.noise and not (zero or several)):
            return None
        begins = onsets(self.recordings, [record.seen_early for record in self._observed()])
        if not begins:
            return None
        used = {shift.recording: shift.seconds for shift in zero.shifts} if zero else {}
        shifts = tuple(shift._replace(seconds=used.get(shift.recording, 0.0)) for shift in begins)
        as_stated = zero.as_stated if zero else path.steps[0].before
        most = len(path.added) - 1 if path.noise else THRESHOLDS.few  # effects that would be an improvement
        tried: list[Begun] = []
        asked: Callable | None = None
        of: SelectionPath | None = None
        for look in (self._at_onsets, self._sharper, self._sharper_by_other_laws, self._sharper_by_other_laws):
            if search_is_over() or (look != self._at_onsets and _leaves_far_more(path)):
                break
            there = () if asked == look and of is path else look(path, begins, shifts, most)
            asked, of = look, path
            if not there or not self._rest_until(there):
                continue
            begun = self._begun(there, as_stated)
            if begun.zero and begun.zero.gain(begun.path.final) < THRESHOLDS.gain:
                continue  # no less than the model as given leaves from the stated time zero on
            tried.append(begun)
            if tried[-1].path.noise:
                return (self._alone(tried[-1]) or tried[-1]) if len(tried[-1].path.added) <= most else None
            if _left_by(tried[-1].path).mean_square < _left_by(path).mean_square:
                path, shifts = tried[-1].path, there
        return None if found.path.noise else _much_better(found.path, tried)

    def _alone(self, found: Begun) -> Begun | None:
        """One effect beside a time zero may make up for what that is off: what is found from where the motion of the
        model as given begins, where that leaves as little and lacks nothing."""
        return self.from_sharper_onsets(found) if found.zero and found.path.added else None

    def _at_onsets(
        self, path: SelectionPath, begins: tuple[Shift, ...], taken: tuple[Shift, ...], most: int
    ) -> tuple[Shift, ...]:
        """The onsets, where some are not where they were taken to be, and what was found leaves less from there on; of
        so much more than noise that a real structure may leave it, next to none of it."""
        pairs = zip(begins, taken, strict=True)
        elsewhere = any(onset.differs and abs(onset.seconds - one.seconds) > onset.period for onset, one in pairs)
        if path.noise or not elsewhere:
            return ()
        records = self._observed(begins)
        magnitudes = measure_magnitudes(path.structure, records)
        there = fit_model(magnitudes, records, path.final.additions).residuals
        least = THRESHOLDS.all_but_folds if _leaves_far_more(path) else 0.0
        return begins if share_removed(_left_by(path), there) > least else ()

    def _sharper(
        self, path: SelectionPath, begins: tuple[Shift, ...], taken: tuple[Shift, ...], most: int,
        others: Sequence[Sequence[Addition]] = (),
    ) -> tuple[Shift, ...]:  # fmt: skip
        """Where the motion with the first effect of a path begins, or what came nearest to one, or with others in its
        place; none where that leaves more than next to nothing, or, with as many effects, gains too little."""
        present, best = path.final.given, path.steps[0].best
        first = path.added[:1] or ([as_found(best)] if best else [])
        choices = [(*present, *one) for one in (first[: min(most, 1)], *others)]
        found = sharpened(begins, taken, path.structure, choices, self._observed, _left_by(path).rms)
        if found is None:
            return ()
        needs_fewer = len(path.added) > 1 or most == 0  # what is found from there on decides
        gains = needs_fewer or (found.of_residuals >= -THRESHOLDS.gain and found.gain > THRESHOLDS.gain)
        return found.shifts if gains and found.mean_square < THRESHOLDS.near_floor else ()

    def _sharper_by_other_laws(
        self, path: SelectionPath, begins: tuple[Shift, ...], taken: tuple[Shift, ...], most: int
    ) -> tuple[Shift, ...]:
        """The same, where it leaves more than noise, with the laws that leave least from the onsets on."""
        if path.noise or not any(onset.differs for onset in begins):
            return ()
        return self._sharper(path, begins, taken, most, self._others(path, begins))

    def _others(self, path: SelectionPath, begins: Sequence[Shift]) -> list[Sequence[Addition]]:
        """What a path may have begun with, had it been taken from the onsets: of all laws of the element on which one
        explained most, those that leave least from there on."""
        fitted = (one.addition for one in path.steps[0].as_recorded if one.fit)
        element = next((one.target for one in fitted if one.effect.acts_on == "element"), None)
        records, present = self._observed(begins), path.final.given
        magnitudes = measure_magnitudes(path.structure, records)
        laws: dict[tuple[str, str], Addition] = {}
        for one in candidates(magnitudes, self.effects, present):
            if one.target == element:
                laws.setdefault((one.effect.name, one.variant), one)
        tried = ((key, law) for key, law in laws.items() if not search_is_over())
        fits = {key: fit(make_problem(magnitudes, records, (*present, law))) for key, law in tried}
        leaves = {key: analyse(one).rms for key, one in fits.items()}
        return [[laws[key]] for key in sorted(leaves, key=leaves.__getitem__)[: THRESHOLDS.few]]

    def _rest_until(self, shifts: Sequence[Shift]) -> bool:
        """Whether the signals rest from the stated time zeros until then, or until a filter may show what comes: what
        moves is not to be left out."""
        stated = self._observed()
        for shift in shifts:
            record = stated[shift.recording]
            before = record.measured[record.time[record.at] < shift.seconds - shift.early]
            if len(before) and np.isfinite(before).any(axis=0).all():
                std = np.hypot(record.noise / np.sqrt(len(before)), record.offset_std)
                if (np.abs(np.nanmean(before, axis=0)) > FARTHEST * std).any():
                    return False
        return True

    def _begun(self, shifts: Sequence[Shift], as_stated: Model) -> Begun:
        elsewhere = tuple(shift for shift in shifts if abs(shift.seconds) > shift.period)
        path = self._selected(self._observed(shifts))
        return Begun(path, TimeZero(elsewhere, as_stated) if elsewhere else None)

    def _selected(self, records: Sequence[ObservedRecord]) -> SelectionPath:
        return first_believed(select(self.structure, records, self.effects))

    def _observed(self, shifts: Sequence[Shift] = ()) -> list[ObservedRecord]:
        moved = [at_its_own_pace(self.structure, one) for one in moved_by(shifts, self.recordings)]
        return [observe(self.structure, *each) for each in zip(moved, rests_of(moved), strict=True)]


def _left_by(path: SelectionPath) -> Residuals:
    """In the sensors' noise."""
    return analyse(path.as_recorded)


def _leaves_far_more(path: SelectionPath) -> bool:
    """Than noise, as a real structure may of any lumped model."""
    return _left_by(path).mean_square >= THRESHOLDS.real_structure


def _much_better(path: SelectionPath, others: Sequence[Begun]) -> Begun | None:
    """One that leaves much less than a path from the stated time zeros, with as many effects at most: of those that
    leave about the least the one that needs fewest."""
    fair = [one for one in others if one.zero and len(one.path.added) <= max(len(path.added), 1)]
    left = [_left_by(one.path) for one in fair]
    least = min((one.mean_square for one in left), default=np.inf)
    pairs = zip(fair, left, strict=True)
    much = [
        (len(one.path.added), there.mean_square, one)
        for one, there in pairs
        if share_removed(_left_by(path), there) > THRESHOLDS.least_share
        and there.mean_square < least + THRESHOLDS.least_share
    ]
    return min(much, key=lambda each: each[:2])[2] if much else None
