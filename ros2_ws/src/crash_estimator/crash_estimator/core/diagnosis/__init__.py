"""Which physical effect a model lacks, and where it fails: output-error fits, compared by their evidence.

`diagnose` compares a structure with whole recordings; `OnlineDiagnosis` says as much as the samples so far allow.
The packages within, each importing only those before it: observation, parameterization, mechanics, output_error,
residuals, selection, report, online.
"""

from .online.candidate_turns import OnlineState
from .online.online_answer import FitCurves, OnlineAnswer, final_answer
from .online.online_diagnosis import OnlineDiagnosis
from .output_error.gauss_newton import iterations_made
from .report.another_recording import Predicted, predict
from .report.diagnosis import Diagnosis, diagnose
from .report.ranking import Ranked, StepReport
from .report.tolerance import DEFAULT, Tolerance, tolerance_of
from .report.verdict import ADEQUATE, EFFECT_MISSING, UNEXPLAINED
from .residuals.misfit_windows import MisfitWindow
from .selection.fitted_model import Model
from .selection.thresholds import THRESHOLDS

__all__ = [
    "ADEQUATE", "DEFAULT", "EFFECT_MISSING", "THRESHOLDS", "UNEXPLAINED", "Diagnosis", "FitCurves", "MisfitWindow",
    "Model", "OnlineAnswer", "OnlineDiagnosis", "OnlineState", "Predicted", "Ranked", "StepReport", "Tolerance",
    "diagnose", "final_answer", "iterations_made", "predict", "tolerance_of",
]  # fmt: skip
