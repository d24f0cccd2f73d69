"""A time zero that was stated wrongly, told as the first of the steps."""

from collections.abc import Mapping

import numpy as np

from ..residuals.residuals import noise_floor
from ..selection.fitted_model import Model
from ..selection.onset_search import Begun
from ..selection.time_zero import TimeZero
from .ranking import Ranked, Rms, StepReport

TIME_ZERO = "time_zero"
"""As the steps name it: no effect of a model but an error of a recording, mended by `import --time-zero S`."""


def time_zero_step(zero: TimeZero, moved: Model, free_run_rms: tuple[float, float]) -> StepReport:
    """The coefficient is the onset's time since the stated zero, s; of several recordings the farthest's, all of them
    beside it.

    moved: the model as given, fitted from the onset on; free_run_rms: of both models' free runs.
    """
    farthest = max(zero.shifts, key=lambda shift: abs(shift.seconds))
    stated, found = zero.as_stated.residuals.rms, moved.residuals.rms
    floor = noise_floor(moved.fit.layout, moved.records)
    each = zero.shifts if len(zero.shifts) > 1 else ()
    return StepReport(
        TIME_ZERO,
        ", ".join(shift.test for shift in zero.shifts),
        farthest.seconds,
        farthest.std,
        "s",
        zero.gain(moved),
        explained=float(np.clip(1.0 - (found / stated) ** 2, 0.0, 1.0)),
        shape={shift.test: shift.seconds for shift in each},
        shape_std={shift.test: shift.std for shift in each},
        residual_rms=vars(Rms(stated, found, floor)),
        free_run_rms={"before": free_run_rms[0], "after": free_run_rms[1]},
        force_explained={},
    )


def as_ranked(step: StepReport) -> Ranked:
    """For where nothing else is missing."""
    told = step.std <= abs(step.coefficient)
    numbers = step.coefficient, step.std, step.unit, step.evidence, step.explained
    return Ranked(step.effect, step.target, *numbers, told, (), step.shape)


def signals_begin(tests: Mapping[str, float]) -> str:
    """tests: s from the stated time zero to the onset, of each."""
    each = ", ".join(f"{1e3 * seconds:+.3g} ms ({test})" for test, seconds in tests.items())
    return f"the signals begin {each} from the stated time zero"


def remarks_on_onsets(begun: Begun) -> list[str]:
    """Of those that are no step: where signals begin elsewhere, whatever a filter shows early."""
    remarks = []
    if elsewhere := {shift.test: shift.seconds for shift in begun.unused if shift.off(0.0)}:
        remarks.append(signals_begin(elsewhere))
    if taken := {shift.test: shift.seconds for shift in begun.taken}:
        remarks.append(f"{signals_begin(taken)}, and are compared from there on")
    return remarks
