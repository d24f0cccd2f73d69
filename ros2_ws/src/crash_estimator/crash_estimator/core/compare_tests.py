"""Comparing tests: one at two sampling rates (thesis 4.5.3), two alike ones by their noise models (7.3).

    noise model of an equation:  D(B) e = A(B) eps,   spectrum  S(f) = dt var(eps) |A / D|^2 at B = exp(-2 pi i f dt)
    difference of two:           chi^2 = delta' (P1 + P2)^-1 delta,   delta of the coefficients, P their covariances

Where the coefficients of two tests of the same car differ by more than chance, or their spectra lie apart in some
band, the structures vibrate differently: there the cars are not alike.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyval

from crash_replay.recording import Recording, RecordingError

from .characteristic import Characteristic
from .estimators.gauss_newton import NoiseModel
from .structure import ModelError
from .validation import LEVELS, chi_square_quantile


class NoiseDifference(NamedTuple):
    chi_square: float
    degrees: int
    spectral_distance: float  # dB, rms over frequency of the ratio of the spectra
    loudest: tuple[float, float]  # Hz and dB: where the spectra differ most, second over first

    def differs(self, level: float) -> bool:
        return self.degrees > 0 and self.chi_square > chi_square_quantile(level, self.degrees)

    @property
    def confidence(self) -> float:
        """The largest of 90, 95, 99 % at which the coefficients differ; 0 for none."""
        return max((level for level in LEVELS if self.differs(level)), default=0.0)


def coarser(recording: Recording, period: float) -> Recording:
    """The recording at steps of `period` s: means over the samples around each instant, which keep the momentum.

    Raises RecordingError where the period is not longer than the recording's own.
    """
    if not period > recording.sample_period > 0.0:
        raise RecordingError(
            f"test {recording.test.id} has a sample every {recording.sample_period * 1e3:g} ms: "
            f"a coarser period must be longer, got {period * 1e3:g} ms"
        )
    step = round(period * 1e9)
    cell = np.floor_divide(2 * recording.time_ns + step, 2 * step)
    cells, start = np.unique(cell, return_index=True)
    values = np.add.reduceat(recording.values, start, axis=0) / np.diff(np.append(start, len(cell)))[:, None]
    return Recording(recording.test, cells * step, values)


def curve_difference(a: Characteristic, b: Characteristic) -> float:
    """Rms difference of two force-crush curves over the crush that both reach, as a share of the larger peak force."""
    low, high = max(a.crush.min(), b.crush.min()), min(a.crush.max(), b.crush.max())
    crush = np.linspace(low, high, 200)
    difference = np.interp(crush, a.crush, a.force) - np.interp(crush, b.crush, b.force)
    return float(np.sqrt(np.mean(difference**2)) / max(np.abs(a.force).max(), np.abs(b.force).max()))


def spectrum(model: NoiseModel, frequency: np.ndarray, dt: float) -> np.ndarray:
    """(n,) one-sided power density of the equation's error, unit^2/Hz, at frequencies in Hz below 1 / (2 dt)."""
    delay = np.exp(-2j * np.pi * frequency * dt)
    a, d = (polyval(delay, [1.0, *c]) for c in (model.a, model.d))
    return 2.0 * dt * model.variance * np.abs(a / d) ** 2


def compare_noise_models(first: NoiseModel, second: NoiseModel, dt: float) -> NoiseDifference:
    """How far two tests' noise models of the same equation and orders are apart, both sampled every dt s."""
    if len(first.d) != len(second.d) or len(first.a) != len(second.a):
        raise ModelError(
            f"noise models are compared at the same orders, got p,q = {len(first.d)},{len(first.a)} "
            f"and {len(second.d)},{len(second.a)}"
        )
    delta = np.concatenate([second.d - first.d, second.a - first.a])
    chi_square = (
        float(delta @ np.linalg.pinv(first.covariance + second.covariance, hermitian=True) @ delta)
        if len(delta)
        else 0.0
    )
    frequency = np.linspace(0.0, 0.5 / dt, 201)[1:]
    ratio = 10.0 * np.log10(spectrum(second, frequency, dt) / spectrum(first, frequency, dt))
    k = int(np.argmax(np.abs(ratio)))
    distance = float(np.sqrt(np.mean(ratio**2)))
    return NoiseDifference(chi_square, len(delta), distance, (float(frequency[k]), float(ratio[k])))


def compare_tests(first: Sequence[NoiseModel], second: Sequence[NoiseModel], dt: float) -> list[NoiseDifference]:
    """One difference for each equation."""
    return [compare_noise_models(a, b, dt) for a, b in zip(first, second, strict=True)]
