"""Three effects outside the vocabulary, that no candidate explains: `unexplained` is the right answer."""

from collections.abc import Mapping

import numpy as np

from ..integrate import simulate
from .specimen import COARSE_RATE, COARSE_STEP, Specimen
from .vocabulary import Hidden, Hide


def rotation(specimen, peaks, target, share, rng):
    """A body that rotates, and an accelerometer that is not at its centre.

        th'' = k a - 2 z w th' - w^2 th        recorded = a + r th'' + r_c th'^2

    a is the body's acceleration, pushed off its centre; tangential and centripetal lever r and r_c. k r is the share:
    the tangential part's size beside a; the largest angular velocity is some 10 rad/s.
    """
    pulsation, damping = 2.0 * np.pi * rng.uniform(8.0, 25.0), 0.05
    sign, lever = float(rng.choice([-1.0, 1.0])), float(rng.uniform(0.1, 0.3))
    channel = _channel_of(specimen, target)

    def distortion(time: np.ndarray, signal: np.ndarray) -> np.ndarray:
        from scipy.signal import lfilter  # late: it takes longer to import than all the rest

        a = np.array([[0.0, 1.0], [-(pulsation**2), -2.0 * damping * pulsation]])
        b, c = np.array([[0.0], [share / lever]]), np.array([a[1], [0.0, 1.0]])
        d = np.array([[share / lever], [0.0]])
        numerators, denominator = _discrete(a, b, c, d, time[1] - time[0])
        angular_acceleration, angular_velocity = (lfilter(n, denominator, signal) for n in numerators)
        return signal + sign * lever * angular_acceleration + lever * angular_velocity**2

    return specimen.with_sensor(channel, distortion=distortion), Hidden("rotation", target, share, "")


def timed_force(specimen, peaks, target, share, rng):
    """A push that depends on time only, such as a device that fires: half a sine of 8 to 25 ms."""
    force = 0.7 * share * peaks.acceleration[target] * specimen.body(target).mass
    start, length = rng.uniform(0.02, 0.05), rng.uniform(0.008, 0.025)
    if specimen.name == "impactor":
        start *= 0.5

    def push(time: np.ndarray) -> np.ndarray:
        phase = np.clip((time - start) / length, 0.0, 1.0)
        return force * np.sin(np.pi * phase)

    return specimen.with_body(target, push=push), Hidden("timed_force", target, force, "N")


def changing_mass(specimen, peaks, target, share, rng):
    """A mass that grows by the share within 30 ms, such as cargo that comes to bear; sooner in the shorter impact."""
    start, length = rng.uniform(0.02, 0.04), 0.03
    if specimen.name == "impactor":
        start, length = 0.4 * start, 0.2 * length

    def growth(time: np.ndarray) -> np.ndarray:
        return 1.0 + share * np.clip((time - start) / length, 0.0, 1.0)

    hidden = Hidden("changing_mass", target, share * specimen.body(target).mass, "kg")
    return specimen.with_body(target, growth=growth), hidden


def nearest_inside(specimen: Specimen, effect: str, target: str) -> Specimen:
    """The specimen with the effect of the vocabulary that comes nearest instead: the mean of what changes.

    A constant mass, weighted with the body's acceleration squared; a constant force; a channel's gain.
    """
    time = np.arange(0.0, specimen.scenario.duration, 1.0 / COARSE_RATE)
    body = specimen.body(target)
    names = [b.name for b in specimen.scenario.system.bodies]
    motion = simulate(specimen.scenario.system, time, COARSE_STEP).acceleration[:, names.index(target)]
    match effect:
        case "changing_mass":
            constant = float(np.average(body.growth(time), weights=motion**2))
            return specimen.with_body(target, mass=constant * body.mass, growth=None)
        case "timed_force":
            constant = float(np.mean(body.push(time)))
            return specimen.with_body(target, push=lambda time: np.full(len(time), constant))
    channel = _channel_of(specimen, target)
    seen = next(s for s in specimen.scenario.sensors if s.channel.name == channel).distortion(time, motion)
    constant = float(motion @ seen / (motion @ motion))
    return specimen.with_sensor(channel, distortion=lambda time, signal: constant * signal)


OUTSIDE: Mapping[str, Hide] = {hide.__name__: hide for hide in (rotation, timed_force, changing_mass)}


def _channel_of(specimen: Specimen, body: str) -> str:
    sensors = specimen.scenario.sensors
    return next(s.channel.name for s in sensors if s.of == body and s.channel.quantity == "acceleration")


def _discrete(a, b, c, d, dt: float):
    """Transfer functions of a state-space model whose input goes straight between samples."""
    from scipy.signal import cont2discrete, ss2tf

    ad, bd, cd, dd, _ = cont2discrete((a, b, c, d), dt, method="foh")
    return ss2tf(ad, bd, cd, dd)
