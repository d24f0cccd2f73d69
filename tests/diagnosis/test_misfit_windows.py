"""Where and when a model fails is told by what stands out of the noise there, and nothing is where nothing does."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from crash_estimator.core.diagnosis.residuals import misfit_windows as module
from crash_estimator.core.diagnosis.residuals.misfit_windows import misfit_windows

DT, SAMPLES, NOISE = 1e-4, 2000, 3.0


@pytest.fixture(autouse=True)
def in_m_per_s2(monkeypatch):
    monkeypatch.setattr(module, "output_scale", lambda layout: np.ones(len(layout.outputs)))


def windows(left: np.ndarray, apart: bool | np.ndarray = False, unloads: bool | np.ndarray = False, seed: int = 1):
    """Of one body that leaves (n,) beside white noise of 3 m/s^2."""
    residual = left + np.random.default_rng(seed).normal(0.0, NOISE, SAMPLES)
    time, at = DT * np.arange(SAMPLES), np.arange(SAMPLES)
    body = SimpleNamespace(name="car")
    link, force = SimpleNamespace(ends=(0, 1)), np.ones(SAMPLES)
    layout = SimpleNamespace(structure=SimpleNamespace(bodies=[body]), outputs=[SimpleNamespace(body=0)], links=[link])
    record = SimpleNamespace(
        time=time, at=at, period=DT, measured=residual[:, None] + 7.0, test=SimpleNamespace(id="T")
    )
    acting = SimpleNamespace(
        force=force, apart=np.broadcast_to(apart, SAMPLES), unloads=np.broadcast_to(unloads, SAMPLES)
    )
    residuals = SimpleNamespace(
        residual=[residual[:, None]], noise=[np.array([NOISE])], links=[[acting]],
        predicted=[np.full((SAMPLES, 1), 7.0)],
    )  # fmt: skip
    return misfit_windows(layout, [record], residuals)


def test_noise_fails_nowhere():
    """In a thousand tests it may once."""
    assert not any(windows(np.zeros(SAMPLES), seed=seed) for seed in range(30))


@pytest.mark.parametrize("size", [4.0, 10.0])
def test_what_stands_out_is_found_where_it_is_and_as_large_as_it_is(size):
    left = np.zeros(SAMPLES)
    left[800:1200] = size * NOISE
    (found,) = windows(left)
    assert found.body == "car" and found.recording == "T"
    assert_allclose([found.start, found.end], [0.08, 0.12], atol=module.WINDOW)
    assert_allclose(found.rms, size * NOISE, rtol=0.1)
    assert_allclose([found.measured - found.predicted, found.predicted], [size * NOISE, 7.0], rtol=0.1)


@pytest.mark.parametrize(
    ("apart", "unloads", "state"), [(False, False, "loading"), (False, True, "unloading"), (True, True, "apart")]
)
def test_what_the_element_does_meanwhile_is_told(apart, unloads, state):
    left = np.zeros(SAMPLES)
    left[800:1200] = 10.0 * NOISE
    assert [window.state for window in windows(left, apart, unloads)] == [state]


def test_a_window_ends_where_the_element_does_something_else():
    """A whole crash was told as one window, and as what the element did for the longer part of it."""
    time = np.arange(SAMPLES)
    left = np.where((time >= 400) & (time < 1600), 10.0 * NOISE, 0.0)
    unloads = (time >= 900) & ~((time >= 1200) & (time < 1205))  # for less than a window not
    found = windows(left, time >= 1500, unloads)
    assert [window.state for window in found] == ["loading", "unloading", "apart"]
    assert_allclose([window.start for window in found[1:]], [0.09, 0.15], rtol=1e-12)
    assert_allclose([window.end for window in found[:-1]], [0.0899, 0.1499], rtol=1e-12)


def test_where_nothing_is_valid_nothing_fails():
    """Between two loud samples, neither of which fails by itself, lies a clipped stretch: a window there sees both."""
    length = int(round(module.WINDOW / DT))
    loud = np.zeros(SAMPLES)
    loud[[799, 800 + length - 3]] = 6.0 * NOISE
    beside = loud.copy()
    beside[800] = beside[799]
    assert windows(beside)
    loud[800 : 800 + length - 3] = np.nan
    assert not windows(loud)
