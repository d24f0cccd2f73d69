"""How large what a fit leaves is, in the band that a lumped model can speak for.

Masses on springs move as a whole; what panels and sensor mounts ring with above that is vibration, which no effect of
the vocabulary explains. So sizes are compared below the lowest channel frequency class of SAE J211 that leaves the
predictions of the model as given nearly as they are, and what lies above is told beside them. What is no crash but
slower has bands further down. A force that was measured on a free body is no prediction: what it holds of high
frequencies says nothing of what the model's elements can follow.
"""

from dataclasses import dataclass

import numpy as np

from crash_replay.conditioning import CFC_CLASSES, RATE_PER_CFC, low_passed

from ..mechanics.masses import masses
from ..observation.pace import LONG
from ..observation.record import ObservedRecord
from ..output_error.gauss_newton import Fit
from ..output_error.normal_equations import may_diverge
from .residuals import Residuals, rms

SPOKEN_FOR = 0.95
"""Share of the predictions' power that lies in the band: the rest is the corners of contacts that open and close. Asked
of the model as given alone: with what was found NHTSA 10146 keeps 0.986 below CFC 60, as given all of it (1.00). At
0.98 recordings of an impactor that swings at 50 Hz, which keep 0.963 to 0.977, were compared up to 300 Hz, where its
case rings: of 50 of them that were `unexplained` 29 are told now, 23 of these its lag or a wrong time zero and 4 its
force limiter. At 0.96, which says the same of its 225, none of 93 looked-at cases of both simulators that leave more
than noise was told otherwise."""

SLOW_CLASSES = (2, 6, 20)
"""Hz, of records that are longer than any crash: the standard's classes, a third each, go on so. Of an axis that moves
below 8 Hz and was pushed by pulses of force, what its drive rings with from 16 to 100 Hz is a third of the misfit below
CFC 60: its dry friction and a constant force explained 0.68 of that, and 0.94 of what is below 3.3 Hz."""


@dataclass(frozen=True)
class InBand:
    """Root mean squares over all outputs, m/s^2; a force counts divided by the mass of all free bodies."""

    rms: float  # of what is left in the band
    noise: float  # of it what the sensors' noise alone would leave
    above: float  # of what is left above the band
    cfc: int | None  # class of the band, `SLOW_CLASSES` too; None: all that was sampled

    @property
    def is_less_than_noise(self) -> bool:
        """What is left beside the noise."""
        return self.rms**2 - self.noise**2 < self.noise**2

    def share_explained(self, before: "InBand") -> float:
        """Of the mean square that another model leaves above the noise, in the same band."""
        above = before.rms**2 - before.noise**2
        return float(np.clip((before.rms**2 - self.rms**2) / above, 0.0, 1.0)) if above > 0.0 else 0.0


def band_of(model) -> int | None:
    """The lowest class below which a `Model`'s predictions are, on all recordings; None where sampling is too slow."""
    records, predicted = model.records, _by_the_model(model)
    period = max(record.period for record in records)
    classes = CFC_CLASSES if min(record.time[-1] for record in records) <= LONG else (*SLOW_CLASSES, *CFC_CLASSES)
    for cfc in classes:
        if period * cfc * RATE_PER_CFC > 1.0:
            return None
        kept = [_kept(each, record.period, cfc) for each, record in zip(predicted, records, strict=True)]
        if min(kept) > SPOKEN_FOR:
            return cfc
    return None


def _by_the_model(model) -> list[np.ndarray]:
    """(n, q) predictions of each record; of a free body that a measured force pushes without what that gives, if the
    model's elements give anything."""
    found = [each.copy() for each in model.residuals.predicted]
    layout = model.fit.layout
    mass = masses(layout, model.fit.theta)
    for q, output in enumerate(layout.outputs):
        applied = layout.structure.bodies[output.body].applied
        if applied and output.quantity == "acceleration":
            for each, record in zip(found, model.records, strict=True):
                by_elements = each[:, q] - record.signals[applied].on_grid[record.at] / mass[output.body]
                each[:, q] = by_elements if by_elements.any() else each[:, q]
    return found


def _kept(predicted: np.ndarray, period: float, cfc: int) -> float:
    """Least share of any output's power that passes the filter."""
    power = (in_class(predicted, period, cfc) ** 2).sum(axis=0)
    return float((power / np.maximum((predicted**2).sum(axis=0), np.finfo(float).tiny)).min())


def in_class(values: np.ndarray, period: float, cfc: int | None) -> np.ndarray:
    """(n, q) channels, filtered; cfc None: as they are, but for what is not valid."""
    if cfc is None:
        return np.nan_to_num(values)
    return np.stack([low_passed(column, period, cfc) for column in np.nan_to_num(values).T], axis=1)


def noise_in_class(record: ObservedRecord, cfc: int | None) -> np.ndarray:
    """(q,) SI standard deviation that the filter leaves of each sensor's noise, as if that were white."""
    impulse = np.zeros((len(record.measured), 1))
    impulse[len(impulse) // 2] = 1.0
    return record.noise * np.linalg.norm(in_class(impulse, record.period, cfc))


@may_diverge
def in_band(fitted: Fit, residuals: Residuals, cfc: int | None) -> InBand:
    """What a fit leaves below a class, and above it."""
    inside, above, noise = [], [], []
    for record, residual in zip(fitted.problem.records, residuals.residual, strict=True):
        left = in_class(residual, record.period, cfc)
        inside.append(left)
        above.append(np.nan_to_num(residual) - left)
        noise.append(np.broadcast_to(noise_in_class(record, cfc), left.shape))
    layout = fitted.layout
    return InBand(rms(layout, inside), rms(layout, noise), rms(layout, above), cfc)
