"""When a fit is believed, when it is better than another one, and when what it adds counts."""

from collections.abc import Sequence

import numpy as np

from ...effects.effect import Addition
from ..observation.record import ObservedRecord
from ..output_error.gauss_newton import Fit
from ..residuals.in_band import in_band
from ..residuals.residuals import Residuals
from .thresholds import THRESHOLDS


def better(one, other) -> bool:
    """Whether a fit of the same model (a `Model` each) in the same noise is a better one.

    The evidence counts what a motion that has not settled would leave, to first order; of one that never settles, that
    is less than it leaves itself. So both must say so.
    """
    more_likely = one.fit.evidence > other.fit.evidence + 1.0
    return more_likely and one.residuals.mean_square < other.residuals.mean_square


def settled(found: Fit, residuals: Residuals) -> bool:
    """Whether what a fit takes its motion to leave, to first order, is about what that motion does leave.

    An element that springs back hard can throw the motion about from one iteration to the next; then the cost, which
    counts the defect as mended, says nothing. Above the noise, which its means over bins partly leave out, the two
    agree but for the prior's share and for what is not linear: within a factor of two.
    """
    samples = sum(np.count_nonzero(np.isfinite(residual)) for residual in residuals.residual)
    above = (residuals.mean_square - 1.0) * samples
    return above < 2.0 * found.cost and found.cost < 2.0 * residuals.mean_square * samples


def cost_of_nothing(records: Sequence[ObservedRecord]) -> float:
    """Of predicting zero: a fit that leaves more has gone astray."""
    return sum(float(np.nansum((record.measured / record.noise) ** 2)) for record in records)


def cost_of_noise(records: Sequence[ObservedRecord]) -> float:
    """Of a fit that leaves only that, as expected: the number of values that are fitted."""
    return float(sum(record.bins * record.measured.shape[1] for record in records))


def mean_square_of_nothing(records: Sequence[ObservedRecord]) -> float:
    """Of predicting zero, as of `Residuals`, in units of the noise."""
    return cost_of_nothing(records) / sum(np.count_nonzero(np.isfinite(record.measured)) for record in records)


def share_removed(before: Residuals, after: Residuals) -> float:
    """Of the mean square residual above that of the noise."""
    return (before.mean_square - after.mean_square) / max(before.mean_square - 1.0, 1e-9)


def explains_too_little(before, after, cfc: int | None) -> bool:
    """Whether an addition that still leaves more than noise removes next to nothing, neither of all that is sampled nor
    in the band that the model speaks for: above that a structure rings, which hides what was explained.

    before, after: the model (a `Model` each) without it and with it, as their errors are told; cfc: the band's class.
    """
    return share_explained(before, after, cfc) < THRESHOLDS.some


def share_explained(before, after, cfc: int | None) -> float:
    """Of what the model before (a `Model` each) leaves, of all that is sampled or in the band, whichever is more."""
    left, without = (in_band(one.fit, one.residuals, cfc) for one in (after, before))
    return max(left.share_explained(without), share_removed(before.residuals, after.residuals))


def needed_gain(model) -> float:
    """Nats that the next addition to a `Model` must gain.

    Where it leaves noise already, or as given less of it than there is, that nothing is missing is a candidate too, and
    has to be told apart.
    """
    if model.white:
        return THRESHOLDS.gain_beyond_white if model.found else THRESHOLDS.confounded
    less_than_noise = not model.found and model.residuals.mean_square < 1.0
    return THRESHOLDS.confounded if less_than_noise else THRESHOLDS.gain


def needed_share(added: Sequence[Addition]) -> float:
    """Of the misfit, that effects must explain to be believed where they leave more than noise: a function of the crush
    follows most of a fold or a break, which no vocabulary has, and one with two shape constants that comes first most
    else. Two laws of one element may be the first terms of another one, and two functions of its crush are a curve
    that follows anything: no share is enough."""
    laws = [one for one in added if one.effect.acts_on == "element"]
    curves = [one for one in laws if one.effect.of_crush_only]
    if _share_a_target(curves):
        return 1.0
    if _share_a_target(laws):
        return THRESHOLDS.practically_all
    two_shapes = any(len(one.effect.shapes_of(one.variant)) > 1 for one in added[:1])
    return THRESHOLDS.nearly_all if curves or two_shapes else THRESHOLDS.most


def _share_a_target(additions: Sequence[Addition]) -> bool:
    return len({one.target for one in additions}) < len(additions)


def odds_against(addition: Addition, fitted: Fit) -> float:
    """Nats that it must gain over others, as it was fitted."""
    return addition.effect.log_prior_odds_against(fitted.layout.structure, coefficient(addition, fitted))


def coefficient(addition: Addition, fitted: Fit) -> float:
    return float(fitted.theta[fitted.layout.term(addition).coefficient])


def among_variants(addition: Addition, gain: float) -> float:
    """Among an effect's own variants: a form other than the usual one of a force that remembers must gain more, and so
    must an unmodelled body that was counted in with another.

    Without a measured force nothing tells that one from one beside the model's masses: halving every force and mass
    leaves the motion as it is.
    """
    unusual = addition.taken_from or (addition.variant and addition.effect.remembers)
    return gain - (THRESHOLDS.gain if unusual else 0.0)
