"""The verdict in two grades: whether something is named, and whether what is left then is complete."""

from collections.abc import Callable, Hashable, Sequence
from typing import NamedTuple

from ..residuals.score_test import Drift
from ..selection.thresholds import THRESHOLDS
from ..selection.time_varying import Varying
from .left import Left
from .ranking import Ranked
from .tolerance import Tolerance

EFFECT_MISSING, ADEQUATE, UNEXPLAINED = "effect_missing", "adequate", "unexplained"

CURVE = "two functions of one crush are a curve that follows anything"
"""Said where no share of the misfit is enough."""


class Evidence(NamedTuple):
    """What a verdict is given on."""

    added: int  # effects
    white: bool  # the last model leaves noise only, band by band
    drift: Drift  # what that goes along with, of all that may vary with time
    before: Left  # of the model as given
    after: Left  # with what was added
    ranking: Sequence[Ranked]  # of the first step
    further: Sequence[Ranked]  # what was added after that, each as its own step has it
    weighed: bool  # the evidence was taken in a noise as large as what is left
    certain: bool  # every coefficient that was added is beyond its standard deviation, and short of its limits
    by_first: float  # share of the misfit in the band that the first effect explains, wherever it is missing
    needed: float  # share that all of them must explain
    place_of: Callable[[str], Hashable]  # what two targets have in common that are the same place
    assumed: bool  # the noise is, of some channel: to be less than it says little
    varying: Varying | None  # with time, and as likely as what was found
    loud: bool  # what is left is more than noise above the frequencies that the sensors' filters show

    @property
    def noise(self) -> bool:
        """What is left is noise in every respect."""
        return self.white and self.drift.constant


class Verdict(NamedTuple):
    word: str
    complete: bool  # what is left is noise, or within the tolerance


def verdict_on(evidence: Evidence, tolerance: Tolerance) -> Verdict:
    """`adequate`: nothing significant is missing, or nothing is named and what is left of the model as given is within
    the tolerance, and no candidate explains any of it or it is less than the noise and no candidate gains much, or
    the noise is assumed;
    `effect_missing`: what is named beats its rivals, what varies with time too, and takes a large share of the misfit
    away; else `unexplained`."""
    if (tolerance.stated or evidence.assumed) and tolerance.admits(evidence.before):
        return Verdict(ADEQUATE, True)
    if evidence.noise:
        astray = bool(evidence.after.astray)
        word = EFFECT_MISSING if evidence.added else UNEXPLAINED if evidence.assumed or astray else ADEQUATE
        too_many = evidence.added > THRESHOLDS.most_at_once
        word = UNEXPLAINED if too_many or evidence.varying else word
        more_than_noise = astray or (word == EFFECT_MISSING and evidence.loud)
        return Verdict(word, not more_than_noise or tolerance.admits(evidence.after))
    within = tolerance.admits(evidence.after)
    if evidence.added and not (evidence.varying or doubt_of(evidence, within)):
        return Verdict(EFFECT_MISSING, within)
    nothing_to_add = not (evidence.added or evidence.white) and _stands_still(evidence)
    doubted = any(one.evidence > THRESHOLDS.gain_beyond_white for one in evidence.ranking)
    less_than_noise = evidence.before.is_less_than_noise and not doubted
    little = tolerance.admits(evidence.before) and (nothing_to_add or less_than_noise)
    return Verdict(ADEQUATE, True) if little else Verdict(UNEXPLAINED, False)


def _stands_still(evidence: Evidence) -> bool:
    """What is left does not go along with a mass, a force, a stiffness or a gain that varies with time: where it looks
    like noise, as of a mimic, not at all, else not most of it; or it is of so little weight beside what one effect
    explains that it may be the form of that."""
    of_little_weight = evidence.by_first > THRESHOLDS.nearly_all
    little_of_it = not evidence.white and evidence.drift.share < THRESHOLDS.half
    return of_little_weight or evidence.drift.constant or little_of_it


def _leaves_next_to_nothing(evidence: Evidence, within: bool) -> bool:
    """One effect leaves so little, beside the noise or the tolerance too, that what varies with time in it is no other
    explanation."""
    little = within or evidence.after.is_less_than_noise
    return (
        evidence.added == 1 and little and evidence.after.share_explained(evidence.before) > THRESHOLDS.practically_all
    )


def doubt_of(evidence: Evidence, within: bool) -> str:
    """What stands against naming what was found where it leaves more than noise, in words; empty: nothing does.

    In the sensors' noise the evidence of what leaves more than that knows no doubt: it has to be weighed first.
    within: what is left is within the tolerance.
    """
    share = evidence.after.share_explained(evidence.before)
    if evidence.added > THRESHOLDS.most_at_once:
        return f"more than {THRESHOLDS.most_at_once} effects are likelier one of another kind"
    if not evidence.certain:
        return "a coefficient is within its standard deviation, or as large as it can be"
    if share <= evidence.needed:
        return f"more than {evidence.needed:.0%} is asked for" if evidence.needed < 1.0 else CURVE
    if not (evidence.weighed or evidence.white):
        return "the evidence was not weighed against what is left"
    if not (_stands_still(evidence) or _leaves_next_to_nothing(evidence, within)):
        return "most of what is left varies with time"
    rivals = [] if within else _unbeaten(evidence)
    return f"{rivals[0].effect} on {rivals[0].target} may do so as well" if rivals else ""


def _unbeaten(evidence: Evidence) -> list[Ranked]:
    """Candidates that the first one does not beat by evidence; of all that were fitted but the same effect elsewhere
    and other laws of the same place: what is missing is sure then, or where; these rivals are named. Where what is left
    is no noise, none may explain nearly as much and leave hardly more, either: evidence grows with what all of them
    explain, and says no more of which it is."""
    (first, *others), place_of = evidence.ranking, evidence.place_of
    elsewhere = [r for r in others if r.fitted and place_of(r.target) != place_of(first.target)]
    unlike = [r for r in elsewhere if r.effect != first.effect]

    def as_much(rival: Ranked) -> bool:
        hardly_more = rival.left < (1.0 + THRESHOLDS.half) * first.left
        return not evidence.white and rival.evidence > THRESHOLDS.nearly_all * first.evidence and hardly_more

    return [r for r in unlike if first.evidence <= r.evidence + THRESHOLDS.confounded or as_much(r)]
