"""What a diagnosis says beside its verdict: of the noise, of onsets, and of a small error that it does not tell."""

from ...sensor_noise import ASSUMED
from ..selection.acceptance import needed_gain
from ..selection.onset_search import Begun
from ..selection.selection_path import SelectionPath
from .left import Left
from .ranking import stated
from .time_zero_step import remarks_on_onsets
from .tolerance import percent


def remarks_on(begun: Begun, missing: bool, left: Left) -> list[str]:
    """missing: effects are told that were added; left: with them."""
    remarks = [f"{channel} runs away: the model is off by more than all that it shows" for channel in left.astray]
    if assumed := with_assumed_noise(begun.path):
        remarks.append(
            f"of {', '.join(assumed)} too little is recorded at rest to tell the noise behind a filter: it is taken "
            f"for {percent(ASSUMED)} of the peak; record 20 ms before time zero, or state it (`noise` of a body)"
        )
    return [*remarks, *remarks_on_onsets(begun), *(_on_a_small_error(begun.path) if missing else [])]


def with_assumed_noise(path: SelectionPath) -> list[str]:
    """Tests."""
    return [one.test.id for one in path.records if any(spectrum.assumed for spectrum in one.spectra)]


def _on_a_small_error(path: SelectionPath) -> list[str]:
    """What the first effect would be beside the error of a channel or a speed that gains enough to be told, and is not,
    as it weighs too little beside what was: a lag of t makes a damper beside a spring k weaker by k t, whatever its
    sigma."""
    last, best = path.steps[-1], path.steps[-1].best
    if last.before is not path.final or not path.added or best is None or not best.fit:
        return []
    effect = best.addition.effect
    if best.gain < needed_gain(path.final) or not (effect.distorts or effect.changes_start):
        return []
    first = path.added[0]
    size, _, _ = stated(best.fit.layout.term(best.addition), best.fit)
    value, std, _ = stated(best.fit.layout.term(first), best.fit)
    error = f"{' on '.join(best.addition.key)} of {f'{size:.3g} {effect.unit}' if effect.unit else f'{size:.2%}'}"
    law = f"{' on '.join(first.key)} would be {value:.4g} +- {std:.2g} {first.effect.unit}"
    return [f"beside {error}, which weighs too little to be told, {law}"]
