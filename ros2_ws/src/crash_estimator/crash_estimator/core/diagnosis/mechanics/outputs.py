"""From accelerations and forces of the bodies to what the channels show, errors and noise of the channels included."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..observation.record import Output
from ..observation.trajectory import Trajectory
from ..parameterization.layout import Experiment, Layout
from .driven_motion import Distortion, distortion
from .linear_system import Sampling
from .masses import masses


class Noise(NamedTuple):
    """Of one sample of each output, and how it grows with parameters: through the masses whose inertia is measured."""

    std: np.ndarray  # (q,) SI
    growth: list[tuple[int, int, float]]  # output, parameter, d ln(std) / d parameter


def output_noise(experiment: Experiment, theta: np.ndarray, samples: int = 1) -> Noise:
    """An attached body's inertia is felt with the noise of its channel: var_q = sigma_q^2 + (m / M)^2 sigma_a^2 s.

    s = 1, or less for means over some samples of an output that a delay of a fraction f of the period smooths:
    1 - 2 f (1 - f) / samples. In noise as large as what residuals leave, a sensor's is contained.
    """
    layout, record, _ = experiment
    variance, growth = record.noise**2, []
    terms = [term for term in layout.terms if term.addition.attaches_body]
    if record.noise_is_inflated or not terms:
        return Noise(record.noise, growth)
    mass, index = masses(layout, theta), layout.structure.body_index
    for term in terms:
        addition = term.addition
        host, sigma = index[addition.host], record.signals[addition.target].noise
        share = float(theta[term.coefficient]) / mass[host]
        slope = (1.0 + (share if addition.taken_from == addition.host else 0.0)) / mass[host]
        for q, output in enumerate(layout.outputs):
            if output.body != host:
                continue
            d = distortion(layout, theta, output.channel)
            f = d.delay / record.period % 1.0
            smoothed = 1.0 - 2.0 * f * (1.0 - f) / samples
            variance[q] += (share * sigma) ** 2 * smoothed
            growth.append((q, term.coefficient, share * slope * sigma**2 * smoothed))
            if d.by_delay >= 0:
                growth.append((q, d.by_delay, (share * sigma) ** 2 * (2.0 * f - 1.0) / (samples * record.period)))
    return Noise(np.sqrt(variance), [(q, p, g / variance[q]) for q, p, g in growth])


def sampling(experiment: Experiment, theta: np.ndarray) -> tuple[Sampling, list[int]]:
    """How rows become outputs, and the parameters that act on outputs only."""
    layout, record, _ = experiment
    found = _distortions(layout, theta)
    lag, fraction = np.divmod([d.delay / record.step for d in found], 1.0)
    return Sampling(
        body=np.array([output.body for output in layout.outputs]),
        of_motion=np.array([output.of_motion for output in layout.outputs]),
        gain=np.array([1.0 + d.gain for d in found]),
        lag=lag.astype(int),
        fraction=fraction,
        bin=record.bin,
        weight=record.valid / output_noise(experiment, theta, record.per_bin).std,
    ), [p for d in found for p in d.parameters]


def predicted(experiment: Experiment, theta: np.ndarray, rows: np.ndarray, trajectory: Trajectory) -> np.ndarray:
    """(g, q) outputs. Accelerations and forces are those of rows (g, b), velocities and displacements the
    trajectory's."""
    layout, record, r = experiment
    outputs = np.zeros((len(record.time), len(layout.outputs)))
    for q, (output, d) in enumerate(zip(layout.outputs, _distortions(layout, theta), strict=True)):
        true = _late(_shown(output, rows, trajectory), d, record.step)
        outputs[:, q] = (1.0 + d.gain) * true + d.offset(record.time) + theta[layout.offsets[r] + q]
        if q in layout.drifts[r]:
            outputs[:, q] += theta[layout.drifts[r][q]] * record.time / record.time[-1]
    return outputs


def by_channel_errors(
    experiment: Experiment, theta: np.ndarray, rows: np.ndarray, trajectory: Trajectory
) -> Iterator[tuple[int, int, np.ndarray]]:
    """Derivatives of what `predicted` gives by what acts on outputs only: (q, parameter, (g,))."""
    layout, record, r = experiment
    for q, (output, d) in enumerate(zip(layout.outputs, _distortions(layout, theta), strict=True)):
        shown = _shown(output, rows, trajectory)
        yield q, layout.offsets[r] + q, np.ones(len(shown))
        if q in layout.drifts[r]:
            yield q, layout.drifts[r][q], record.time / record.time[-1]
        yield from ((q, p, course) for p, course in d.offset_by(record.time))
        if d.by_gain >= 0:
            yield q, d.by_gain, _late(shown, d, record.step)
        if d.by_delay >= 0:
            whole, fraction = _steps_late(d, record.step)
            slope = (_delayed(shown, whole + 1) - _delayed(shown, whole)) / record.step
            slope[whole : whole + 1] *= fraction == 0.0
            yield q, d.by_delay, (1.0 + d.gain) * slope


def _distortions(layout: Layout, theta: np.ndarray) -> list[Distortion]:
    return [distortion(layout, theta, output.channel) for output in layout.outputs]


def _shown(output: Output, rows: np.ndarray, trajectory: Trajectory) -> np.ndarray:
    """(g,) what a channel without errors shows."""
    return (rows, trajectory.v, trajectory.x)[output.of_motion][:, output.body]


def _steps_late(d: Distortion, step: float) -> tuple[int, float]:
    """Whole steps of the grid, and the rest of one."""
    whole, fraction = divmod(d.delay / step, 1.0)
    return int(whole), fraction


def _late(shown: np.ndarray, d: Distortion, step: float) -> np.ndarray:
    """By the channel's delay."""
    whole, fraction = _steps_late(d, step)
    if not fraction:
        return _delayed(shown, whole)
    late = (1.0 - fraction) * _delayed(shown, whole) + fraction * _delayed(shown, whole + 1)
    late[whole : whole + 1] = 0.0  # still an instant before the impact
    return late


def _delayed(values: np.ndarray, steps: int) -> np.ndarray:
    return values if not steps else np.concatenate([np.zeros(steps), values[: len(values) - steps]])
