"""What a diagnosis says of a crash whose model lacks an effect, as the viewer and the terminal are given it."""

import numpy as np
from helpers_viewer import Crash

from crash_estimator.viewer.findings import Candidate, Finding, MisfitBlock, RankingBlock, RevisionBlock, Window

ADDED = "coulomb_friction on cab_engine"
NOISE = np.array([10.0, 10.0, 5e3])  # cab m/s^2, engine m/s^2, barrier N


def candidate(name: str, evidence: float, rivals: tuple[str, ...] = (), explained: float = 0.5) -> Candidate:
    effect, _, target = name.partition(" on ")
    return Candidate(effect, target, 1810.0, 190.0, "N", evidence, explained, not rivals, rivals)


def ranking(time: float, evidence: float, final: bool = False, revision: int = 0, **fields) -> RankingBlock:
    """Coulomb friction leads with `evidence` nats; nothing is missing with it added (revision 1)."""
    rivals = () if final else ("viscous_damping on cab_engine",)
    ranked = (candidate(ADDED, evidence, rivals), candidate("viscous_damping on cab_engine", 0.9 * evidence, (ADDED,)))
    missing = revision == 0 and evidence > 6.0
    verdict = "effect_missing" if missing else "adequate"
    errors = dict(rms_before=10.5 if revision else 40.0, rms_after=10.5, noise_floor=10.0, white_after=True)
    errors |= dict(white_before=revision > 0, free_run_before=11.0 if revision else 44.0, free_run_after=11.0)
    settled = dict(number=round(time * 1e4), final=final, found=(ADDED,) if missing else (), revision=revision)
    shown = ranked + (candidate("clearance on cab_barrier", 1.0),)
    block = RankingBlock(0, 0, time, final, "two_mass", verdict, shown, 0.0, 0.0, 0.0, "one line")
    return block._replace(**errors, **settled, **fields)


def misfit(end: float) -> MisfitBlock:
    """The engine is wrong from 10 ms to the turn at 30 ms, and from then on while it unloads."""
    windows = [Window(0.01, min(end, 0.03), "engine", "loading", 30.0)]
    windows += [Window(0.03, end, "engine", "unloading", 50.0)] if end > 0.03 else []
    return MisfitBlock(0, round(end * 1e4), tuple(windows))


def revision(crash: Crash, model: str, error: float, final: bool, rows: slice = slice(None)) -> RevisionBlock:
    """A fit that is `error` of the signal off."""
    after = crash.time_ns >= 0
    measured, predicted = crash.measured[after][rows], (1 - error) * crash.truth[after][rows]
    std = np.tile(NOISE, (len(measured), 1))
    outputs = ("cab", "engine", "barrier"), ("m/s^2", "m/s^2", "N")
    time_ns = crash.time_ns[after][rows]
    return RevisionBlock(0, 0, time_ns, model, final, *outputs, measured, predicted, measured - predicted, std)


def story(crash: Crash) -> list[Finding]:
    """As a replay brings it: the ranking ripens, then the answer on all samples, then that on the model with it."""
    end = crash.time_ns[-1] * 1e-9
    found: list[Finding] = []
    for k, evidence in enumerate((2.0, 20.0, 60.0)):
        time, rows = 0.02 * (k + 1), slice(200 * k, 200 * (k + 1))
        found += [ranking(time, evidence), misfit(time), revision(crash, "two_mass", 0.3, False, rows)]
    given, better = (revision(crash, name, e, True) for name, e in (("two_mass", 0.3), (f"two_mass + {ADDED}", 0.0)))
    found += [ranking(end, 300.0, final=True), misfit(0.06), given, better]
    return found + [ranking(end, 2.0, final=True, revision=1), MisfitBlock(0, len(crash.time_ns), ()), better]
