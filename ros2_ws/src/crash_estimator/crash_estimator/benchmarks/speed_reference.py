"""What the steps are compared with: C++ compiled on the spot, filterpy, and the readable numpy form."""

import ctypes
import shutil
import subprocess
from pathlib import Path
from typing import NamedTuple

import numpy as np

from crash_replay.recording import Recording

from ..core.estimator import Estimator
from ..core.methods import make_estimator
from ..core.structure import Structure

SOURCE = Path(__file__).with_name("speed_reference.cpp")


class Problem(NamedTuple):
    """A record's regressions: n samples, p estimated parameters, q equations."""

    psi: np.ndarray  # (n, q, p)
    target: np.ndarray  # (n, q) measured minus known
    walk: np.ndarray  # (n, p) relative variance of the random walk
    active: np.ndarray  # (n, p) 1.0 where estimated
    noise: np.ndarray  # (q,) variance
    initial: np.ndarray  # (p,)
    std: np.ndarray  # (p,)
    lower: np.ndarray  # (p,)
    upper: np.ndarray  # (p,)
    scale: np.ndarray  # (p,)


def regressions(structure: Structure, recording: Recording) -> Problem:
    """Those that the constrained Kalman filter meets on the recording, from the first that tells anything."""
    estimator = make_estimator(structure, recording.test, "constrained_kalman", compiled=False)
    assert isinstance(estimator, Estimator)
    state, met = estimator.init(), []
    for sample in recording.samples():
        kinematics, motion = estimator.kinematics.step(state.kinematics, sample)
        stiffness = estimator.regressor.secant(state.update.theta, state.contact.peak_crush)
        _, law, _ = estimator.contact.step(state.contact, motion, stiffness, None)
        regression, _ = estimator.regressor.make(motion, law, state.update.theta)
        if motion.dt > 0.0 and Estimator._excited(regression):
            met.append(regression)
        state, _ = estimator.step(state, sample)
    settings, keep = estimator.method.settings, estimator.method.settings.std > 0.0
    return Problem(
        np.array([r.gradient[:, keep] for r in met]),
        np.array([r.measured - r.known for r in met]),
        np.array([r.walk[keep] for r in met]),
        np.array([r.active[keep] for r in met], dtype=float),
        np.nan_to_num(met[-1].noise, nan=1.0),
        *(part[keep] for part in (settings.initial, settings.std, settings.lower, settings.upper, settings.scale)),
    )


class Compiled:
    """The C++ reference as a library; None in `make` where there is no g++."""

    def __init__(self, library: Path):
        self.library = ctypes.CDLL(str(library))
        for name in ("constrained_kalman", "mrls"):
            getattr(self.library, name).restype = ctypes.c_double

    @staticmethod
    def make(folder: Path) -> "Compiled | None":
        compiler, library = shutil.which("g++"), folder / "speed_reference.so"
        if compiler is None:
            return None
        command = [compiler, "-O3", "-march=native", "-shared", "-fPIC", str(SOURCE), "-o", str(library)]
        subprocess.run(command, check=True)
        return Compiled(library)

    def constrained_kalman(self, problem: Problem) -> np.ndarray:
        """theta (p,) after the whole record."""
        n, q, p = problem.psi.shape
        theta, factors = problem.initial.copy(), np.diag(problem.std**2)
        samples = problem.psi, problem.target, problem.walk, problem.active
        arrays = *samples, problem.noise, problem.lower, problem.scale, theta, factors
        self.library.constrained_kalman(n, p, q, *map(_pointer, arrays))
        return theta

    def mrls(self, problem: Problem, forgetting: float, m: int, cr: float, limit: float, rewinds: int) -> np.ndarray:
        n, q, p = problem.psi.shape
        theta, information = problem.initial.copy(), np.diag(problem.std**-2.0)
        number = ctypes.c_double
        self.library.mrls(
            n, p, q, *map(_pointer, (problem.psi, problem.target, problem.noise)), number(forgetting), m, number(cr),
            number(limit), rewinds, _pointer(theta), _pointer(information),
        )  # fmt: skip
        return theta


def _pointer(array: np.ndarray) -> ctypes.c_void_p:
    return array.ctypes.data_as(ctypes.c_void_p)


def filterpy_step(problem: Problem, k: int):
    """-> a function that makes sample k's predict and update with filterpy; None where it is not installed."""
    try:
        from filterpy.kalman import KalmanFilter
    except ImportError:
        return None
    _, q, p = problem.psi.shape
    kalman = KalmanFilter(dim_x=p, dim_z=q)
    kalman.x, kalman.P = problem.initial[:, None].copy(), np.diag(problem.std**2)
    kalman.F, kalman.R = np.eye(p), np.diag(problem.noise)
    kalman.Q = np.diag(problem.walk[k] * np.maximum(np.abs(problem.initial), 0.05 * problem.scale) ** 2)
    z, h = problem.target[k][:, None].copy(), problem.psi[k].copy()  # a column: a flat z silently broadcasts its state

    def step():
        kalman.predict()
        kalman.update(z, H=h)

    return step
