"""What really happened in a simulated test, beside what its sensors recorded."""

from typing import NamedTuple

import numpy as np

from .forces import Law
from .integrate import History
from .system import Element, System

SMALLEST_CRUSH = 1e-6
"""m: at no crush F / X has no value; its limit is taken here."""


class BodyTruth(NamedTuple):
    displacement: np.ndarray  # (n,) m
    velocity: np.ndarray  # (n,) m/s
    acceleration: np.ndarray  # (n,) m/s^2
    load: np.ndarray  # (n,) N, sum of the element forces on it


class ElementTruth(NamedTuple):
    """Compression positive. `stiffness` is the K of F = K X: the secant F / X, and on an unloading line that
    of its peak, F(X_peak) / X_peak; NaN where the element is apart. `secant` is F / X of the spring throughout."""

    crush: np.ndarray  # (n,) m
    rate: np.ndarray  # (n,) m/s
    peak: np.ndarray  # (n,) m, the largest crush so far, never below 0
    force: np.ndarray  # (n,) N, spring, damper and all else
    spring_force: np.ndarray  # (n,) N
    stiffness: np.ndarray  # (n,) N/m
    secant: np.ndarray  # (n,) N/m
    state: np.ndarray  # (n,) "loading" (at its largest crush; elastic: |X| grows), "unloading" or "apart"


class ChannelTruth(NamedTuple):
    signal: np.ndarray  # (n,) SI
    noise: float  # standard deviation, SI
    offset: float  # SI


def body_truths(system: System, history: History) -> dict[str, BodyTruth]:
    columns = (history.displacement, history.velocity, history.acceleration, history.load)
    return {body.name: BodyTruth(*(c[:, k] for c in columns)) for k, body in enumerate(system.bodies)}


def element_truths(system: System, history: History) -> dict[str, ElementTruth]:
    return {element.name: _element_truth(element, k, history) for k, element in enumerate(system.elements)}


def _element_truth(element: Element, k: int, history: History) -> ElementTruth:
    crush, rate, peak = history.crush[:, k], history.rate[:, k], history.peak[:, k]
    after = history.time >= 0.0
    static = getattr(element.spring, "static", element.spring)  # without what depends on the rate
    spring_force = np.where(after, _evaluated(static, crush, rate, peak), 0.0)
    plastic = getattr(element.spring, "unloading", None) is not None
    on_line = plastic & (crush < peak)
    none = np.abs(crush) < SMALLEST_CRUSH
    lever = np.where(on_line, peak, crush)
    lever = np.where(np.abs(lever) < SMALLEST_CRUSH, SMALLEST_CRUSH, lever)
    loaded = _evaluated(static, lever, np.zeros(len(lever)), np.maximum(lever, 0.0)) / lever
    apart = ~after | ((spring_force == 0.0) & (~none | on_line))
    unloads = on_line if plastic else crush * rate < 0.0
    return ElementTruth(
        crush, rate, peak, history.force[:, k], spring_force,
        stiffness=np.where(apart, np.nan, loaded),
        secant=np.where(none, loaded, spring_force / np.where(none, 1.0, crush)),
        state=np.where(apart, "apart", np.where(unloads, "unloading", "loading")),
    )  # fmt: skip


def _evaluated(law: Law, *columns: np.ndarray) -> np.ndarray:
    return np.array([law(*row) for row in zip(*(column.tolist() for column in columns))])
