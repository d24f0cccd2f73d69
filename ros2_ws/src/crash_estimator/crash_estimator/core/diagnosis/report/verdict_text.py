"""A diagnosis in one readable line."""

from collections.abc import Sequence

from crash_replay.gravity import G

from ...effects.kinds.body_inertia import WEIGHED_TO
from ...structure import Structure
from ...structure_parts import ALL, SPRINGS
from ..selection.fitted_model import Model
from ..selection.thresholds import THRESHOLDS
from .left import Left, vibration_of
from .ranking import Rms, StepReport
from .time_zero_step import TIME_ZERO, signals_begin
from .tolerance import Tolerance, percent
from .verdict import ADEQUATE, EFFECT_MISSING, Evidence, Verdict, doubt_of

LASTING = {SPRINGS: "elastic forces that act on", ALL: "all forces that act on, dampers' too,"}
"""By `acts_when_spent`."""


def verdict_text(
    verdict: Verdict, evidence: Evidence, tolerance: Tolerance, steps: Sequence[StepReport], final: Model, size: Rms,
    structure: Structure,
) -> str:  # fmt: skip
    """final: the model with what was added; size: of the residuals; structure: as the model file says."""
    if verdict.word == ADEQUATE:
        said = f"adequate: {_adequate(evidence, tolerance, final, size)}"
    elif verdict.word == EFFECT_MISSING:
        said = f"effect missing: {_missing(evidence, tolerance, steps, final, size)}"
    else:
        said = f"unexplained: {_unexplained(evidence, tolerance, steps, final, size)}"
    below = final.records[0].below
    if below < float("inf"):
        said += f"; what rings above {below:g} Hz, {vibration_of(final) / G:.3g} g, is left out"
    masses = _masses_otherwise(final) if evidence.noise else []
    said = "; with ".join([said, *_contacts_otherwise(structure, final.fit.layout.structure), *masses])
    if any(step.recording for step in steps):
        said += "; what is wrong in one recording is mended in its description, not in the model"
    if steps and steps[0].effect == TIME_ZERO:
        moved = steps[0].shape or {steps[0].target: steps[0].coefficient}
        said += f"; {signals_begin(moved)}: `import --time-zero S` moves it, by so many s"
    return said


def _contacts_otherwise(given: Structure, assumed: Structure) -> list[str]:
    """What the recordings bear out of the contacts, and the model file does not say."""
    pairs, found = list(zip(given.elements, assumed.elements, strict=True)), []
    if any(g.damper_pulls and not a.damper_pulls for g, a in pairs):
        found.append("contacts that never pull, not even by their dampers")
    lasting = {a.acts_when_spent for g, a in pairs if g.acts_when_spent != a.acts_when_spent}
    found += [f"{LASTING[what]} beside a spring that is spent, as long as there is crush" for what in lasting]
    return found


def _masses_otherwise(final: Model) -> list[str]:
    """Of the masses those that had to be taken otherwise than stated, by more than two standard deviations of what a
    mass is known to: one right mass in twenty would be."""
    layout, theta = final.fit.layout, final.fit.theta
    off = {layout.bodies[k]: float(theta[parameter]) for k, parameter in layout.weighed.items()}
    words = [
        f"{name} {percent(abs(share), 2)} {'heavier' if share > 0.0 else 'lighter'}"
        for name, share in off.items()
        if abs(share) > 2.0 * WEIGHED_TO
    ]
    return [f"{' and '.join(words)} than stated"] if words else []


def _adequate(evidence: Evidence, tolerance: Tolerance, final: Model, size: Rms) -> str:
    left = f"residual RMS {size.after / G:.3g} g, noise floor {size.noise_floor / G:.3g}"
    if not evidence.noise:
        return f"{_what_is_left(evidence.after)}, is within {tolerance.text} ({left})"
    until = (
        "" if _unloads(final) else "; the recording ends before anything unloads: what would come then is not judged"
    )
    return f"nothing significant is missing ({left}){until}"


def _missing(evidence: Evidence, tolerance: Tolerance, steps: Sequence[StepReport], final: Model, size: Rms) -> str:
    alike = [one for one in (*evidence.ranking[:1], *evidence.further) if one.confounded_with]
    each = (
        f"{one.name if len(steps) > 1 else 'this'} cannot be told from {', '.join(one.confounded_with)}"
        for one in alike
    )
    where = " on one recording: record another speed" if len(final.records) == 1 else " on these recordings"
    advice = f"; {', '.join(each)}{where}" if alike else ""
    if evidence.noise:
        small = size.before < THRESHOLDS.near_floor**0.5 * size.noise_floor
        why = f"; small, yet noise would not leave it ({steps[0].evidence:.0f} nats of evidence)" if small else ""
        more = "" if tolerance.admits(evidence.after) else ", beyond which more than noise is left: incomplete"
        white = f"now white{_in_the_band(final)}{more if evidence.loud else ''}"
        return f"{_names(steps)}; {_told(size)}, {white}{why}{advice}"
    within = tolerance.admits(evidence.after)
    grade = f"is within {tolerance.text}" if within else f"is more than {tolerance.text}, and is no noise: incomplete"
    explains = f"{'it' if len(steps) == 1 else 'they'} {_explained(steps, evidence)}"
    return f"{_names(steps)}; {explains}, {_fall(evidence)}; {_what_is_left(evidence.after)}, {grade}{advice}"


def _in_the_band(model: Model) -> str:
    """Where filtered sensors end the comparison: what a model leaves beyond is in its RMS and says nothing of it."""
    passed = min(spectrum.passed for record in model.records for spectrum in record.spectra)
    return f" below {passed:.0f} Hz, up to where the sensors' filters show it" if passed < float("inf") else ""


def _unexplained(evidence: Evidence, tolerance: Tolerance, steps: Sequence[StepReport], final: Model, size: Rms) -> str:
    names, sizes, drift, varying = _names(steps), _told(size), evidence.drift, evidence.varying
    if varying:
        better = f"{names}: no better than" if names else "no candidate explains what is left as well as"
        return f"{sizes}; {better} {varying.what} that varies with time, with {varying.explained:.0%} of the misfit"
    if evidence.white and drift.constant:  # several effects together
        return f"{names} together leave only noise; {sizes}; one effect of another kind is likelier than so many"
    along = f"{drift.what} that varies with time, as no candidate does"
    if evidence.white:
        given = f"with {names} it looks white" if steps else "it looks white"
        return f"{given}; {sizes}; yet what is left goes along with {along}"
    worst, within = final.residuals.band_test.worst, tolerance.admits(evidence.after)
    layout = final.fit.layout
    where = (
        f"{layout.outputs[worst.output].channel} of {final.records[worst.record].test.id}, "
        f"{worst.low:.0f} to {worst.high:.0f} Hz"
    )
    done = f"{names} {_explained(steps, evidence)}, but {doubt_of(evidence, within)}; " if steps else ""
    left = f"no candidate explains what is left, most of it in {where}"
    varies = drift.share > THRESHOLDS.some and not drift.constant
    also = f"; {drift.share:.0%} of it goes along with {along}" if varies else ""
    return f"{done}{sizes}; {left}{also}"


def _names(steps: Sequence[StepReport]) -> str:
    return ", ".join(step.name for step in steps)


def _explained(steps: Sequence[StepReport], evidence: Evidence) -> str:
    share = evidence.after.share_explained(evidence.before)
    return f"{'explains' if len(steps) == 1 else 'explain'} {share:.0%} of the misfit"


def _told(size: Rms) -> str:
    return f"residual RMS {size.before / G:.3g} -> {size.after / G:.3g} g, noise floor {size.noise_floor / G:.3g}"


def _fall(evidence: Evidence) -> str:
    before, after = evidence.before, evidence.after
    return f"RMS {before.rms / G:.3g} -> {after.rms / G:.3g} g" + (f" below {after.band}" if after.cfc else "")


def _what_is_left(left: Left) -> str:
    if not left.channels:
        return "what is left"
    worst = left.channels[0]
    return f"what is left, {percent(worst.of_peak)} of the peak of {worst.channel}"


def _unloads(model: Model) -> bool:
    """Whether any element is seen to come back from its largest crush."""
    links = [link for record in model.residuals.links for link in record]
    return any((link.unloads & ~link.apart).any() for link in links)
