"""What the diagnosis says, as the viewer is given it: the ranking, where the model fails, and each revision's curves.

Neither ROS nor Rerun here; SI units, as in crash_msgs.
"""

import re
from typing import NamedTuple

import numpy as np

FOUND = 6.0
"""Nats of evidence from which a candidate counts."""
EFFECT_MISSING = "effect_missing"
"""The verdict that names what the model lacks (Ranking.msg)."""


class Candidate(NamedTuple):
    """One effect in the ranking."""

    effect: str
    target: str
    coefficient: float
    std: float
    unit: str
    evidence: float  # nats
    explained: float  # share of the residual's variance
    identifiable: bool
    confounded_with: tuple[str, ...]

    @property
    def name(self) -> str:
        return f"{self.effect} on {self.target}"


class RankingBlock(NamedTuple):
    """The ranking as far as the samples go."""

    run: int
    number: int
    time: float  # s since the impact
    final: bool
    model: str
    verdict: str
    ranking: tuple[Candidate, ...]
    rms_before: float  # m/s^2
    rms_after: float
    noise_floor: float
    text: str
    revision: int = 0  # effects added to the diagnosed model or taken out of it
    found: tuple[str, ...] = ()  # "effect on target" that are missing, one added after the other
    white_before: bool = False
    white_after: bool = False
    free_run_before: float = np.nan  # m/s^2
    free_run_after: float = np.nan
    force: str = ""  # channel of the measured force, where the share that all inertias explain is known
    force_explained_before: float = np.nan  # 0 to 1
    force_explained_after: float = np.nan
    complete: bool = True  # what is left with what was found is noise, or within the tolerance

    @property
    def said(self) -> str:
        """The verdict in words."""
        grade = "" if self.complete or self.verdict != EFFECT_MISSING else ", and not all that is missing"
        return f"{self.verdict.replace('_', ' ')}{grade}"


class Window(NamedTuple):
    """A stretch of time in which a residual leaves its band."""

    start: float  # s
    end: float
    body: str
    state: str
    rms: float  # m/s^2


class MisfitBlock(NamedTuple):
    """All windows so far."""

    run: int
    number: int
    windows: tuple[Window, ...]


class RevisionBlock(NamedTuple):
    """n samples of q outputs of one revision of the model."""

    run: int
    number: int
    time_ns: np.ndarray  # (n,) ns since the impact
    model: str  # "frontal_single + unmodelled_body on engine_ax"
    final: bool  # False: of samples that have just come, as the answer stood then
    name: tuple[str, ...]
    unit: tuple[str, ...]
    measured: np.ndarray  # (n, q)
    predicted: np.ndarray
    residual: np.ndarray
    residual_std: np.ndarray

    @property
    def changes(self) -> list[str]:
        """What was added and taken out since the model was given: "+ coulomb_friction on door_rib"."""
        return re.split(r" (?=[+-] )", self.model)[1:]

    @property
    def label(self) -> str:
        """Short: "as given", or the last change."""
        return self.changes[-1] if self.changes else "as given"


Finding = RankingBlock | MisfitBlock | RevisionBlock
"""What belongs to no estimator."""
