"""Chapters 4 and 6 of the page: each a list of Markdown lines, its figures drawn into a folder."""

from pathlib import Path

import numpy as np

from ..core.characteristic import characteristics
from ..core.validation import LEVELS
from ..figures import Line, Panel, draw, markdown_table
from ..model_file import load_model
from . import cases
from .experiments import (
    GAUSS_NEWTON,
    PASSES,
    SETTLED,
    Covariances,
    NoiseOrders,
    uncorrelated_limit,
)  # fmt: skip

TABLE_6_1 = ((0.923, 0.031, 0.174), (0.031, 1.146, -0.127), (0.174, -0.127, 1.203))
"""Error covariance over noise variance, 5.68e-9 (...) / 11.37e-9."""


def chapter_4(found: list[NoiseOrders], of_the_model: list[NoiseOrders], figures: Path) -> list[str]:
    """of_the_model: the same with noise that is ARMA(1,2)."""
    limits = [f"{uncorrelated_limit(found[0].lags, *order):.1f}" for order in found[0].q]
    rows, panels = [], []
    for one, noise in [(one, "sine and white") for one in found] + [(one, "ARMA(1,2)") for one in of_the_model]:
        rows.append(
            (
                f"{one.which}, {noise}",
                *(f"{np.median(one.q[o]):.0f}" for o in one.q),
                *(f"{np.mean(one.uncorrelated[o]):.0%}" for o in one.q),
                *(f"{np.median(one.inside[o]):.0%}" for o in one.q),
                *(f"{np.median(one.rms[o]):.0f}" for o in one.q),
                f"{np.median(one.apart):.2f}",
                f"{np.median(one.within):.0%}",
            )
        )
    for one in found:
        panels += _noise_orders(one)
    head = (
        "K/M, noise",
        "Q 0,0",
        "Q 1,2",
        "uncorrelated 0,0",
        "1,2",
        "lags in limit 0,0",
        "1,2",
        "error of K/M 0,0",
        "1,2",
        "apart, sigma",
        "within 2 sigma",
    )
    draw(figures / "chapter_4.png", panels, columns=4)
    return [
        "## 4.5.1 Noise models: p,q = 0,0 and 1,2", "",
        "One mass, C/M = 1, 13.3 m/s, 80 samples; noise 10 sin(0.3 t) and random of variance 10. Recursive "
        f"Gauss-Newton with a memory of {GAUSS_NEWTON['memory'] * 1e3:g} ms, {GAUSS_NEWTON['noise_memory'] * 1e3:g} "
        f"ms for the noise model; with 1,2 it goes over the record {PASSES} times, each from the noise model that "
        "the one before ended with (5.3: \"an iterative estimation method is required\"). Q is Ljung and Box's over "
        f"{found[0].lags} lags, a quarter of the samples, less p + q degrees of freedom; below {limits[0]} (0,0) and "
        f"{limits[1]} (1,2) the innovation passes for uncorrelated at 95 %. (\"White\", on the other pages, is what "
        "passes the diagnosis's band test, which needs to know the sensor's noise.)", "",
        markdown_table(head, rows), "",
        "*Apart*: median over time of |difference of the two K/M| over its sigma; *within*: share of the time (from "
        f"{SETTLED * 1e3:g} ms on) within two; of two normal variables of that sigma they would be 0.67 and 95 %. Here "
        "they are closer: both sigmas count errors of the motion, which are the same in both. *Error of K/M*: rms, "
        "1/s^2, of about 600.", "",
        "As in the thesis, the residual of 0,0 is auto-correlated and both orders find the same K/M within their "
        "sigmas, because the residual does not go along with the inputs.", "",
        "Which noise: in 4.5.1 the thesis adds a sine and white noise to the simulated acceleration, by its words, "
        "and says that the residual of 0,0 is autocorrelated; that the residual of 1,2 is not it does not say. By "
        "4.1 and 4.12 the equation error is an ARMA(p,q) process, so the last rows have the same experiment with "
        "noise that is one. There 1,2 leaves it uncorrelated. A sine plus white noise is no ARMA(1,2): it is "
        "ARMA(2,2) with all roots on the unit circle, which takes longer than 80 samples to be told. ARMA(1,2) "
        "fitted by least squares to that noise alone, without any car, passes in 8 % of 40 repetitions of 81 "
        "samples, and the recursion with 2,2 in about half. So with the thesis's noise 1,2 takes most of the "
        "autocorrelation away (Q, *lags in limit*), not all of it.", "",
        *_accelerations(found), "![noise models](thesis/chapter_4.png)", "",
    ]  # fmt: skip


def _accelerations(found: list[NoiseOrders]) -> list[str]:
    rows = [
        (
            f"{one.which}, {p},{q}", f"{np.median(one.fit[p, q]):.1f}",
            *(f"{x:.0%}" for x in np.median(one.crossed[p, q], axis=0)),
        )
        for one in found
        for p, q in one.q
    ]  # fmt: skip
    return [
        "Estimated acceleration, - K X - C V, against the assumed one without noise (figures 4.5, 4.7), rms in "
        "m/s^2 of a peak of about 250; and the lags of the residual's cross-correlation with the inputs that are "
        "within the 99 % limit:", "",
        markdown_table(("K/M, p,q", "rms", "with crush", "with rate"), rows), "",
        "The thesis shows curves only and says that the residual of either order \"does not cross correlate with "
        "the input\".", "",
    ]  # fmt: skip


def _noise_orders(one: NoiseOrders) -> list[Panel]:
    k, correlation, crush = [], [], []
    for (p, q), (result, judged) in one.example.items():
        time = np.array([e.time_ns for e in result.estimates]) * 1e-6
        value = np.array([e.parameters[0] for e in result.estimates])
        k.append(Line(time, value, f"{p},{q}", spread=np.array([e.std[0] for e in result.estimates])))
        correlation.append(Line(judged.auto.lags, judged.auto.values, f"{p},{q}"))
        limits = [(sign * judged.auto.limit(level), f"{level:.0%}") for level in LEVELS for sign in (1, -1)]
        for name, cross in judged.cross.items():
            if name.endswith("crush"):
                crush.append(Line(cross.lags, cross.values, f"{p},{q}"))
                cross_limits = [(sign * cross.limit(0.99), "99%") for sign in (1, -1)]
    k.append(Line(time, one.truth, "assumed", "#222222", "--"))
    last = one.example[1, 2][0].estimates
    shown = [Line(time, np.array([e.measured[0] for e in last]), "with noise", "#aaaaaa")]
    shown += [Line(time, np.array([-e.force[0] for e in last]), "estimated, 1,2")]
    shown += [Line(time, one.assumed, "assumed", "#222222", "--")]
    return [
        Panel(f"K/M {one.which} (figures 4.4, 4.6)", "time in ms", "1/s^2", k, y_range=(0.0, 1200.0)),
        Panel(f"acceleration {one.which} (figures 4.5, 4.7)", "time in ms", "m/s^2", shown),
        Panel("auto-correlation of the innovation", "lag, samples", "", correlation, limits, y_range=(-1.05, 1.05)),
        Panel("cross-correlation with the crush", "lag, samples", "", crush, cross_limits, y_range=(-1.05, 1.05)),
    ]


def chapter_6(found: Covariances, with_offsets: Covariances, figures: Path) -> list[str]:
    """with_offsets: the errors of the zero offsets estimated as well."""
    median = np.median(found.ratio, axis=0)
    rows = [
        (name, *(f"{x:.2f}" for x in TABLE_6_1[k]), *(f"{x:.2f}" for x in median[k]))
        for k, name in enumerate(found.equations)
    ]
    away = [np.abs(r - np.diag(np.diag(r))).max() / np.diag(r).mean() for r in found.ratio]
    structure = load_model("side_dummy")
    description, estimates, _ = found.example
    panels = []
    for law, element in zip(
        characteristics(structure, description, estimates), cases.dummy().system.elements, strict=False
    ):
        grid = np.linspace(0.0, law.crush.max(), 200)
        truth = np.array([element.spring(x, 0.0, x) for x in grid]) * 1e-3
        index = description.elements.index(law.element)
        crush = np.array([e.crush[index] for e in estimates if e.time_ns > 0]) * 1e3
        force = np.array([e.force[index] for e in estimates if e.time_ns > 0]) * 1e-3
        lines = [Line(crush, force, "estimated"), Line(grid * 1e3, truth, "assumed, loading", "#222222", "--")]
        panels.append(Panel(f"{law.element} (figure 6.9)", "crush in mm", "kN", lines))
    draw(figures / "chapter_6.png", panels, columns=3)
    names = found.equations
    return [
        "## 6.4.3 The dummy, constrained Kalman filter", "",
        "Error covariance over noise variance (table 6.1): five stiffnesses, three equations, 10 kHz, 3 g of noise.",
        "",
        markdown_table(("", *(f"thesis {n}" for n in names), *names), rows), "",
        f"Largest off-diagonal element of a repetition over its mean diagonal: median {np.median(away):.2f}. With "
        "the zero offsets' errors estimated too (`offsets`, our default) the diagonal is "
        + ", ".join(f"{x:.2f}" for x in np.diag(np.median(with_offsets.ratio, axis=0)))
        + ": a wrong zero, integrated twice, need not be explained by a stiffness.", "",
        "![dummy](thesis/chapter_6.png)", "",
    ]  # fmt: skip
