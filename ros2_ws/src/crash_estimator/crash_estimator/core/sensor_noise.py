"""How large a sensor's own noise is: from its rest before the impact and from its high-frequency content after it."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from .differences import SMALLEST, by_differences, by_rounding

if TYPE_CHECKING:
    from .noise_spectrum import Colour, NoiseSpectrum

ENOUGH = 30
"""Samples before the impact from which their scatter is taken seriously."""

FAST = 4000.0
"""Hz: below this rate a difference filter passes too much of the crash itself."""

AGREE = 1.25
"""Ratio up to which the two estimates are the same noise, and are pooled."""

EFFICIENCY = 0.19
"""Share of its samples that the median of fourth differences of white noise is worth (simulated)."""

REST = 0.015
"""s: of a shorter rest the noise behind a filter is not believed where the filter does not show. Three looked-at tests
with 10 ms of it were told false time zeros; an impactor's, filtered, with 20 ms is told right as it is."""

FILTERED = 1e-4
"""Share of the largest value, of what is fast in a channel, below which a filter has taken it away: 80 dB is more than
recorders of crashes have. What is left of it says nothing of what is slow."""

ASSUMED = 0.03
"""Share of the largest value that a sample of its noise before the filter is taken for then: of 242 looked-at channels
of somebody else's, filtered by CFC 60 or 180, with 20 ms of rest or more, it was 1.3 % in the median and 0.5 to 3.4 %
of nine in ten. Taken large, as noise that is taken for too small makes effects of what it leaves: of 40 such tests 31
are told right so, 23 were without it; with 1 %, of 13 of these 6 were."""


def sensor_noise(
    values: np.ndarray, time_ns: np.ndarray, rests: bool, alike: "Sequence[Colour]" = (), derived: bool = False
) -> "NoiseSpectrum":
    """Of values (n,). A vibrating structure is noisier in the crash than at rest: then that is the floor a model can
    reach. Rest alone tells whether neighbouring samples are alike; alike: colours that the noise of other rests has;
    derived: of another channel, which has smoothed it.

    It is no less than that of rounding to a recorder's steps: at rest less may show."""
    # late: a viewer has started before there is any noise
    from .noise_spectrum import SLOWEST_FILTER, NoiseSpectrum, noise_spectrum

    before, after = values[time_ns < 0], values[time_ns >= 0]
    period, peak = float(np.median(np.diff(time_ns))) * 1e-9, float(np.abs(values).max(initial=0.0))
    standing, rests = rests, rests and len(before) >= ENOUGH
    at_rest = noise_spectrum(before, period, alike) if rests else NoiseSpectrum(np.nan, 0.0, period)
    rest, busy = at_rest.std, np.nan
    if len(after) >= ENOUGH and period * FAST > 1.0 and not rests:
        busy = _highest_frequencies(after)
    elif len(after) >= ENOUGH and period * FAST <= 1.0:
        busy = by_differences(after)
    shown = rests and not (at_rest.corner == np.inf and busy < rest / AGREE and len(before) * period < REST)
    if standing and not (shown or derived) and busy < FILTERED * peak:  # a filter's, that the rest is too short for
        found = NoiseSpectrum(ASSUMED * peak, EFFICIENCY * len(after), period, corner=SLOWEST_FILTER, assumed=True)
    elif np.isnan(rest) or busy > AGREE * rest:
        found = NoiseSpectrum(float(np.nan_to_num(busy)), EFFICIENCY * len(after), period)
    elif not at_rest.white or np.isnan(busy) or busy < rest / AGREE:
        found = at_rest
    else:
        n_rest, n_busy = len(before), EFFICIENCY * len(after)
        pooled = np.sqrt((n_rest * rest**2 + n_busy * busy**2) / (n_rest + n_busy))
        found = NoiseSpectrum(float(pooled), n_rest + n_busy, period)
    least = max(SMALLEST * peak, by_rounding(values), 1e-12)
    return found._replace(std=max(found.std, least), samples=max(found.samples, 2.0))


def _highest_frequencies(values: np.ndarray) -> float:
    """Standard deviation of white noise whose power is that of the highest quarter of the frequencies: of a slow
    recording a difference filter passes the motion itself. The median keeps lines of the motion's own out."""
    power = np.abs(np.fft.rfft((values - values.mean()) * np.hanning(len(values)))) ** 2
    highest = power[-(len(power) // 4) :]
    return float(np.sqrt(np.median(highest) / np.log(2.0) / np.sum(np.hanning(len(values)) ** 2)))
