"""What a model leaves, in the band that a lumped model can speak for, channel by channel."""

from dataclasses import dataclass

import numpy as np

from ...rating import rate
from ..observation.whitening import filtered
from ..output_error.normal_equations import may_diverge
from ..parameterization.layout import Layout
from ..parameterization.nuisances import BEYOND_DOUBT
from ..residuals.in_band import SLOW_CLASSES, InBand, in_band, in_class, noise_in_class
from ..residuals.residuals import rms
from ..selection.fitted_model import Model


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
class Left(InBand):
    """Of all channels, and of each."""

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
    def astray(self) -> list[str]:
        """Channels that the model leaves more of than they ever show."""
        return [one.channel for one in self.channels if one.of_peak > 1.0]

    @property
    def band(self) -> str:
        if self.cfc in SLOW_CLASSES:
            return f"{self.cfc / 0.6:.2g} Hz"  # as CFC 60 passes what is below 100 Hz
        return f"CFC {self.cfc}" if self.cfc else "all sampled"

    def as_json(self) -> dict:
        return {
            "rms": self.rms, "unit": "m/s^2", "of_peak": self.of_peak, "rating": self.rating, "band": self.band,
            "above_band": self.above, "where": [vars(one) for one in self.channels],
        }  # fmt: skip


@may_diverge
def left_by(model: Model, cfc: int | None) -> Left:
    """What a model leaves below a class, and above it."""
    layout, channels = model.fit.layout, []
    for record, residual in zip(model.records, model.residuals.residual, strict=True):
        measured, left = (in_class(values, record.period, cfc) for values in (record.measured, residual))
        channels += _channels(layout, record.test.id, measured, left, noise_in_class(record, cfc))
    channels += _not_compared(model)
    worst_first = tuple(sorted(channels, key=lambda one: -one.of_peak))
    return Left(**vars(in_band(model.fit, model.residuals, cfc)), channels=worst_first)


def _not_compared(model: Model) -> list[ChannelLeft]:
    """Displacements of bodies that no spring holds, where the model leaves the range that was measured: less than that
    the errors of the forces on a body, which add up, may do. As a share of that range, not of the peak."""
    layout, found = model.fit.layout, []
    compared = {output.channel for output in layout.outputs}
    of_bodies = [(k, body.displacement) for k, body in enumerate(layout.structure.bodies) if body.free]
    for record, motion in zip(model.records, model.fit.trajectories, strict=True):
        for k, channel in of_bodies:
            if channel and channel not in compared:
                shown = record.signals[channel].on_grid
                off, span = float(np.sqrt(np.mean((motion.x[:, k] - shown) ** 2))), float(np.ptp(shown))
                if off > span > 0.0:
                    found.append(ChannelLeft(channel, record.test.id, off, "m", off / span, 0.0))
    return found


def vibration_of(model: Model) -> float:
    """m/s^2, RMS of what a model leaves above the band that it was compared in."""
    above = []
    for record, residual in zip(model.records, model.residuals.residual, strict=True):
        values, n = np.nan_to_num(residual), len(residual)
        inside = np.arange(n) / (2.0 * n * record.period) < record.below
        above.append(values - filtered(values, np.repeat(inside[:, None], values.shape[1], axis=1)))
    return rms(model.fit.layout, above)


def _channels(
    layout: Layout, recording: str, measured: np.ndarray, left: np.ndarray, floor: np.ndarray
) -> list[ChannelLeft]:
    found = []
    for q, output in enumerate(layout.outputs):
        peak, size = float(np.abs(measured[:, q]).max()), float(np.sqrt(np.mean(left[:, q] ** 2)))
        if peak > BEYOND_DOUBT * floor[q]:  # else there is nothing to compare
            rating = _rating(measured[:, q], measured[:, q] - left[:, q])
            found.append(ChannelLeft(output.channel, recording, size, output.unit, size / peak, rating))
    return found


def _rating(measured: np.ndarray, predicted: np.ndarray) -> float | None:
    try:
        return rate(measured, predicted).overall
    except ValueError:
        return None
