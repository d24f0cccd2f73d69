"""Evidence that a verdict is given on, made up: dry friction explains most of what a car's model leaves."""

from dataclasses import replace

from crash_estimator.core.diagnosis.report.left import ChannelLeft, Left
from crash_estimator.core.diagnosis.report.ranking import Ranked
from crash_estimator.core.diagnosis.report.verdict import Evidence
from crash_estimator.core.diagnosis.residuals.score_test import Drift
from crash_estimator.core.diagnosis.selection.thresholds import THRESHOLDS

STANDS_STILL = Drift(False, 1e-9, "the mass of car", 0.1)
NOTHING_VARIES = STANDS_STILL._replace(constant=True)
VARIES = STANDS_STILL._replace(share=0.8)


def left(of_peak: float, rms: float, rating: float | None = 0.9) -> Left:
    return Left(rms, 0.1, 0.0, 60, (ChannelLeft("car_ax", "test", rms, "m/s^2", of_peak, rating),))


def ranked(effect: str, target: str, evidence: float, explained: float = 0.1, fitted: bool = True) -> Ranked:
    return Ranked(effect, target, 1.0, 0.1, "N", evidence, explained, True, (), fitted=fitted)


LEADER = ranked("coulomb_friction", "car_barrier", 50.0, explained=0.9)
GAINS_LITTLE = (replace(LEADER, evidence=15.0),)
BEYOND_DOUBT = replace(LEADER, evidence=1000.0)
HARDLY_MORE = BEYOND_DOUBT, ranked("clearance", "engine", 960.0, explained=0.86)
HALF_AS_MUCH_AGAIN = BEYOND_DOUBT, ranked("clearance", "engine", 960.0, explained=0.84)
LESS_LIKELY = BEYOND_DOUBT, ranked("clearance", "engine", 940.0, explained=0.86)
EVIDENCE = Evidence(
    1, False, STANDS_STILL, left(0.2, 10.0, 0.5), left(0.05, 2.0), (LEADER,), (), True, True,
    by_first=0.0, needed=THRESHOLDS.most, place_of=str, assumed=False, varying=None, loud=False,
)  # fmt: skip
