"""A final answer told in about ten lines of a terminal."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from crash_replay.gravity import G

if TYPE_CHECKING:  # an answer brings it along
    from ..core.diagnosis import OnlineAnswer

CANDIDATES = 3
WINDOWS = 2


class Told(NamedTuple):
    """The final answer on one revision of the model."""

    name: str  # "side_dummy + coulomb_friction on door_rib"
    answer: "OnlineAnswer"


def story(revisions: Sequence[Told]) -> list[str]:
    """Lines on the last revision: what is so, where it fails, what may be missing; and the error of all revisions."""
    name, answer = revisions[-1]
    lines = [f"{name}: {answer.text}"]
    worst = sorted(answer.misfit, key=lambda w: -w.rms * (w.end - w.start) ** 0.5)[:WINDOWS]
    lines += [
        f"  fails at {w.body}, {w.state}, {w.start * 1e3:.1f} to {w.end * 1e3:.1f} ms: residual RMS {w.rms / G:.3g} g"
        for w in sorted(worst, key=lambda w: w.start)
    ]
    for place, one in enumerate(answer.ranking[:CANDIDATES] if answer.found else (), start=1):
        rivals = f", not told from {', '.join(one.confounded_with)}" if one.confounded_with else ""
        lines.append(
            f"  {place}. {one.name}: {one.coefficient:.4g} +- {one.std:.2g} {one.unit}, {one.evidence:.1f} nats, "
            f"explains {one.explained:.0%}{rivals}"
        )
    for each, told in revisions:
        left = "white" if told.white[0].white else "not white"
        lines.append(
            f"  error of {each}: fit {told.rms.before / G:.3g}, free run {told.free_run.before / G:.3g} g "
            f"(noise floor {told.noise_floor / G:.3g}), what is left is {left}"
        )
    return lines
