"""When what was found should not be believed before the model itself has been checked: one sentence.

A structure that is wrong in its bodies, masses or attachments, or a recording that is in its units, signs or initial
velocities, still gets an answer, as the effects of the vocabulary are bent to do its work. What gives it away: as given
it leaves most of what a channel measures, and no effect mends that; or an element never touches; or effects are
stacked; or one of them is as large as it may be.
"""

import numpy as np

from .core.diagnosis import Diagnosis, Model
from .tables import never_touches

LITTLE = 0.5
"""Share of a channel's mean square: with less, what is missing is larger than what is there."""

HEARD = 3.0
"""Standard deviations of the noise: what a channel measures must be above it to count."""

STACK = 3
"""Effects: two may well be missing at once."""

AT_LIMIT = 0.999


def doubt(found: Diagnosis) -> str:
    """One sentence where the model itself, or what the recording states, may be wrong, else nothing."""
    if found.verdict == "adequate":
        return ""
    reasons = []
    channel, share = worst_explained(found.models[0])
    if share < LITTLE and found.verdict == "unexplained":
        reasons.append(f"as given it explains {max(share, 0.0):.0%} of {channel}")
    reasons += [never_touches(name) for name in found.models[0].untouched]
    if len(found.steps) >= STACK:
        reasons.append(f"it takes {len(found.steps)} effects to mend it")
    reasons += [f"{name} is as large as it may be, {limit}" for name, limit in at_limit(found)]
    if not reasons:
        return ""
    check = f"check its bodies, masses and attachments, and units, signs and initial velocities ({starts(found)})"
    return f"the model itself or the recording may be wrong ({', '.join(reasons)}): {check}"


def starts(found: Diagnosis) -> str:
    """How fast the free bodies start in the first recording: one forgotten, or the wrong way, is easily seen."""
    given = found.models[0].records[0].test.initial_velocity
    return ", ".join(f"{b.name} {given.get(b.name, 0.0):.4g}" for b in found.structure.bodies if b.free) + " m/s"


def worst_explained(model: Model) -> tuple[str, float]:
    """The channel of which a fit leaves most, and the share of its mean square, above the noise, that it explains."""
    worst = "", 1.0
    for q, output in enumerate(model.fit.layout.outputs):
        measured = np.concatenate([record.measured[:, q] for record in model.records])
        left = np.concatenate([residual[:, q] for residual in model.residuals.residual])
        noise = float(np.nanmean([np.nanmean(record.noise_of_samples[:, q] ** 2) for record in model.records]))
        power = float(np.nanmean(measured**2))
        if power > HEARD**2 * noise:
            share = 1.0 - max(float(np.nanmean(left**2)) - noise, 0.0) / (power - noise)
            worst = min(worst, (output.channel, share), key=lambda one: one[1])
    return worst


def at_limit(found: Diagnosis) -> list[tuple[str, str]]:
    """Effects added whose coefficient has come to the largest size that is admitted, and that."""
    layout, theta = found.models[-1].fit.layout, found.models[-1].fit.theta
    added = {(step.effect, step.target) for step in found.steps}
    known = []
    for term in layout.terms:
        value, low, high = (of[term.coefficient] for of in (theta, layout.prior.low, layout.prior.high))
        limit = high if value > 0.0 else low
        if term.addition.key in added and limit and value / limit > AT_LIMIT:
            known.append((" on ".join(term.addition.key), f"{limit:g} {term.addition.effect.unit}".rstrip()))
    return known
