"""Models and steps of a selection whose fits are made up."""

from types import SimpleNamespace

from crash_estimator.core.diagnosis.selection.candidate_fits import CandidateFit
from crash_estimator.core.diagnosis.selection.selection_step import SelectionStep

RARE = {"maxwell_element", "gas_cushion", "guide_friction", "force_offset"}
"""Effects that are looked for last."""


def model(left: float, additions: int = 0, evidence: float = 0.0) -> SimpleNamespace:
    """One that leaves a mean square of residuals, in the variance of the noise, with so many additions."""
    fit = SimpleNamespace(problem=SimpleNamespace(noise_is_inflated=False), evidence=evidence, additions=additions)
    residuals, found = SimpleNamespace(mean_square=left), ("one",) * additions
    return SimpleNamespace(
        roughness=None, fit=fit, residuals=residuals, white=left < 1.1, additions=found, given=(), found=found,
        records=(),
    )  # fmt: skip


def step(before: SimpleNamespace, gain: float = 500.0) -> SelectionStep:
    effect = SimpleNamespace(name="friction", acts_on="element", distorts="", changes_start=False)
    addition = SimpleNamespace(effect=effect, key=("friction", "spring"))
    return SelectionStep(before, [CandidateFit(addition, gain, SimpleNamespace(evidence=gain))])
