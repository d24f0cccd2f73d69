"""What a model leaves: how large it is, in the band that a lumped model can speak for, channel by channel.

Masses on springs move as a whole; what panels and sensor mounts ring with above that is vibration, which no effect of
the vocabulary explains. So sizes are compared below the lowest channel frequency class of SAE J211 that leaves the
model's own predictions nearly as they are, and what lies above is told beside them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from crash_replay.conditioning import CFC_CLASSES, RATE_PER_CFC, cfc_filter

from ...rating import rate
from ..observation.whitening import filtered
from ..output_error.normal_equations import may_diverge
from ..parameterization.layout import Layout
from ..residuals.residuals import rms
from ..selection.fitted_model import Model

SPOKEN_FOR = 0.99
"""Share of the predictions' power that lies in the band: the rest is the corners of contacts that open and close."""

HEARD = 3.0
"""Standard deviations of the noise in the band: a channel whose peak is below has nothing to compare."""


@dataclass(frozen=True)
class ChannelLeft:
    """Of one channel of one recording, in the band."""

    channel: str
    recording: str
    rms: float
    unit: str
    of_peak: float  # rms as a share of the largest value measured
    rating: float | None  # ISO/TS 18571, 0 to 1; None where it cannot be rated


@dataclass(frozen=True)
class Left:
    """What a model leaves; the sizes are those in the band."""

    rms: float  # m/s^2, over all outputs; a force counts divided by the mass of all free bodies
    noise: float  # m/s^2, of it what the sensors' noise alone would leave
    above: float  # m/s^2, of what is left above the band
    cfc: int | None  # class of the band; None: all that was sampled
    channels: tuple[ChannelLeft, ...]  # the worst first

    @property
    def of_peak(self) -> float:
        """The largest of any channel."""
        return max((one.of_peak for one in self.channels), default=0.0)

    @property
    def rating(self) -> float | None:
        """The lowest of any channel."""
        return min((one.rating for one in self.channels if one.rating is not None), default=None)

    @property
    def is_less_than_noise(self) -> bool:
        """What is left beside the noise."""
        return self.rms**2 - self.noise**2 < self.noise**2

    @property
    def band(self) -> str:
        return f"CFC {self.cfc}" if self.cfc else "all sampled"

    def as_json(self) -> dict:
        return {
            "rms": self.rms, "unit": "m/s^2", "of_peak": self.of_peak, "rating": self.rating, "band": self.band,
            "above_band": self.above, "where": [vars(one) for one in self.channels],
        }  # fmt: skip

    def share_explained(self, before: "Left") -> float:
        """Of the mean square that another model leaves above the noise, in the same band."""
        above = before.rms**2 - before.noise**2
        return float(np.clip((before.rms**2 - self.rms**2) / above, 0.0, 1.0)) if above > 0.0 else 0.0


def band_of(model: Model) -> int | None:
    """The lowest class below which a model's predictions are, on all recordings; None where sampling is too slow."""
    period = max(record.period for record in model.records)
    for cfc in sorted(CFC_CLASSES):
        if period * cfc * RATE_PER_CFC > 1.0:
            return None
        kept = [_kept(each, record.period, cfc) for each, record in zip(model.residuals.predicted, model.records)]
        if min(kept) > SPOKEN_FOR:
            return cfc
    return None


def _kept(predicted: np.ndarray, period: float, cfc: int) -> float:
    """Least share of any output's power that passes the filter."""
    power = (_filtered(predicted, period, cfc) ** 2).sum(axis=0)
    return float((power / np.maximum((predicted**2).sum(axis=0), np.finfo(float).tiny)).min())


def _filtered(values: np.ndarray, period: float, cfc: int | None) -> np.ndarray:
    if cfc is None:
        return np.nan_to_num(values)
    return np.stack([cfc_filter(column, period, cfc) for column in np.nan_to_num(values).T], axis=1)


@may_diverge
def left_by(model: Model, cfc: int | None) -> Left:
    """What a model leaves below a class, and above it."""
    layout, channels, inside, above, noise = model.fit.layout, [], [], [], []
    for record, residual in zip(model.records, model.residuals.residual, strict=True):
        measured, left = (_filtered(values, record.period, cfc) for values in (record.measured, residual))
        floor = record.noise * np.linalg.norm(_impulse_response(len(measured), record.period, cfc))
        channels += _channels(layout, record.test.id, measured, left, floor)
        inside.append(left)
        above.append(np.nan_to_num(residual) - left)
        noise.append(np.broadcast_to(floor, left.shape))
    worst_first = tuple(sorted(channels, key=lambda one: -one.of_peak))
    return Left(rms(layout, inside), rms(layout, noise), rms(layout, above), cfc, worst_first)


def vibration_of(model: Model) -> float:
    """m/s^2, RMS of what a model leaves above the band that it was compared in."""
    above = []
    for record, residual in zip(model.records, model.residuals.residual, strict=True):
        values, n = np.nan_to_num(residual), len(residual)
        inside = np.arange(n) / (2.0 * n * record.period) < record.below
        above.append(values - filtered(values, np.repeat(inside[:, None], values.shape[1], axis=1)))
    return rms(model.fit.layout, above)


def _impulse_response(samples: int, period: float, cfc: int | None) -> np.ndarray:
    """Of white noise of standard deviation one, its norm is what the filter leaves."""
    impulse = np.zeros((samples, 1))
    impulse[samples // 2] = 1.0
    return _filtered(impulse, period, cfc)


def _channels(
    layout: Layout, recording: str, measured: np.ndarray, left: np.ndarray, floor: Sequence[float]
) -> list[ChannelLeft]:
    found = []
    for q, output in enumerate(layout.outputs):
        peak, size = float(np.abs(measured[:, q]).max()), float(np.sqrt(np.mean(left[:, q] ** 2)))
        if peak > HEARD * floor[q]:
            rating = _rating(measured[:, q], measured[:, q] - left[:, q])
            found.append(ChannelLeft(output.channel, recording, size, output.unit, size / peak, rating))
    return found


def _rating(measured: np.ndarray, predicted: np.ndarray) -> float | None:
    try:
        return rate(measured, predicted).overall
    except ValueError:
        return None
