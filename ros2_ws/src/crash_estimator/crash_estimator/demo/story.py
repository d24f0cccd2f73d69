"""The search for what is missing, told on the terminal: where the model fails, what it lacks, how the error falls."""

from collections.abc import Sequence

from ..viewer.findings import EFFECT_MISSING, FOUND, Candidate, MisfitBlock, RankingBlock, Window
from ..viewer.units import shown, with_std

SURE = 3
"""Rankings in a row that a candidate leads before it is worth a line."""
SIGNS = 2
"""Lines of this kind."""
WINDOWS = 2

G = shown("m/s^2")


class Story:
    """Takes what the diagnosis says, in its order, and gives the lines that are worth telling."""

    def __init__(self) -> None:
        self.leader, self.led, self.signs = "", 0, 0
        self.finals: dict[int, RankingBlock] = {}  # by revision
        self.lacks: list[str] | None = None  # told after where it fails; None: not known yet, or told

    @property
    def complete(self) -> bool:
        """Whether the last answer that is to be expected has come: with what was found added, if anything was."""
        if not self.finals:
            return False
        first = self.finals[min(self.finals)]
        return self.added or not (first.found and first.verdict == EFFECT_MISSING)

    @property
    def added(self) -> bool:
        """Whether an effect was added."""
        return len(self.finals) > 1

    def misfit(self, block: MisfitBlock) -> list[str]:
        """Where the model as it was given fails, and what it lacks: told with the first answer on all samples."""
        if self.lacks is None:
            return []
        lacks, self.lacks = self.lacks, None
        worst = sorted(block.windows, key=lambda w: -w.rms * (w.end - w.start) ** 0.5)[:WINDOWS]
        lines = [_where(window) for window in sorted(worst, key=lambda w: w.start)]
        return [f"where it fails: {'; '.join(lines)}"] * bool(lines) + lacks

    def ranking(self, block: RankingBlock) -> list[str]:
        if not block.final:
            return self._sign(block)
        if block.revision in self.finals:
            return []
        self.finals[block.revision] = block
        if self.added:
            return self._after(block)
        self.lacks = _lacks(block)
        errors = f"error {G.factor * block.rms_before:.3g} {G.unit}, noise floor {G.factor * block.noise_floor:.3g}"
        return [f"all samples: {block.said}; {errors}"]

    def _sign(self, block: RankingBlock) -> list[str]:
        best = block.ranking[0] if block.ranking and block.verdict == EFFECT_MISSING else None
        name = best.name if best else ""
        self.led = self.led + 1 if name == self.leader else 1
        self.leader = name
        if not best or self.led != SURE or self.signs == SIGNS:
            return []
        self.signs += 1
        return [f"{1e3 * block.time:5.1f} ms: {name} would explain {best.explained:.0%} of the misfit so far"]

    def _after(self, block: RankingBlock) -> list[str]:
        first = self.finals[min(self.finals)]
        return [_fall(first, block), f"verdict with it: {block.said}{_rest(block)}"]


def _where(window: Window) -> str:
    moment = f"{1e3 * window.start:.1f} to {1e3 * window.end:.1f} ms"
    return f"{window.body}, {window.state}, {moment}: RMS {G.factor * window.rms:.3g} {G.unit}"


def _lacks(block: RankingBlock) -> list[str]:
    """The best candidate where it counts, and its rivals."""
    best = block.ranking[0] if block.ranking else None
    if best is None or best.evidence < FOUND:
        return []
    said = "what it lacks" if block.verdict == EFFECT_MISSING else "the best candidate, which does not explain it"
    rivals = f"not told from it here: {_listed(best.confounded_with)}"
    share = f"{block.force_explained_before:.0%} -> {block.force_explained_after:.0%}"
    force = f"share of {block.force} that the inertias explain: {share}"
    return [f"{said}: {_named(best)}"] + [rivals] * bool(best.confounded_with) + [force] * bool(block.force)


def _named(one: Candidate) -> str:
    value = f"{with_std(one.coefficient, one.std)} {one.unit}"
    return f"{one.name}, {value}; evidence {one.evidence:.0f} nats, explains {one.explained:.0%}"


def _fall(before: RankingBlock, after: RankingBlock) -> str:
    fit, run = (
        f"{G.factor * a:.3g} -> {G.factor * b:.3g} {G.unit}"
        for a, b in ((before.rms_before, after.rms_before), (before.free_run_before, after.free_run_before))
    )
    left = "white" if after.white_before else "not white"
    floor = f"noise floor {G.factor * after.noise_floor:.3g}"
    return f"the error falls: {fit} (simulated freely {run}), {floor}; what is left is {left}"


def _rest(block: RankingBlock) -> str:
    return f", it also lacks {_listed(block.found)}" if block.found else ""


def _listed(names: Sequence[str], most: int = 3) -> str:
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")
