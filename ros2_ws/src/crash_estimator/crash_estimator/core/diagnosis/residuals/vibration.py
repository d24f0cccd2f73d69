"""Where vibration begins: what a lumped model that lacks something leaves falls with frequency; a rise is none of it.

Masses move the less the faster they are pushed: a force that is missing leaves an acceleration whose power falls from
band to band, or at most, where a force jumps, stays as it is. A sensor's mount or a panel that rings leaves a hump:
more in a band than below it, or more than noise where all below is noise.
"""

from collections.abc import Sequence

import numpy as np

from ..observation.record import ObservedRecord
from .band_test import EDGES, SIGNIFICANT, power_in_bands, probability_of
from .residuals import Residuals

SLOWEST = EDGES[3]
"""Hz: below it are a structure's own motion and its first modes (SAE J211: CFC 60 is 3 dB down at 100 Hz)."""


def vibrates_from(residuals: Residuals, records: Sequence[ObservedRecord]) -> float:
    """Hz from which on any output shows more than below; inf: none does."""
    found = [np.inf]
    for record, z in zip(records, residuals.in_noise, strict=True):
        for column, samples in zip(z.T, [spectrum.samples for spectrum in record.spectra], strict=True):
            quietest, noise_only = (np.inf, 1), True
            for low, _, _, power in power_in_bands(column[np.isfinite(column)], record.period, EDGES):
                mean, count = float(power.mean()), len(power)
                more_than_noise = probability_of(count, samples, mean) < SIGNIFICANT
                rises = probability_of(count, quietest[1], mean / max(quietest[0], 1.0)) < SIGNIFICANT
                if low >= SLOWEST and (rises or (noise_only and more_than_noise)):
                    found.append(low)
                    break
                quietest, noise_only = min(quietest, (mean, count)), noise_only and not more_than_noise
    return min(found)
