"""Chapters 4 to 6 of the page: each a list of Markdown lines, its figures drawn into a folder."""

from pathlib import Path

import numpy as np

from ..core.characteristic import characteristics
from ..core.validation import LEVELS, validate
from ..figures import Line, Panel, draw, markdown_table
from ..model_file import load_model
from . import cases
from .experiments import (
    FOLDER,
    FRONTAL,
    GAUSS_NEWTON,
    PASSES,
    SETTLED,
    SIDE,
    Covariances,
    NoiseOrders,
    Ratios,
    white_limit,
)  # fmt: skip

TABLE_5_1 = {"rls": (1.47, 0.83, 1.46), "mrls": (0.94, 0.79, 0.90)}
TABLE_5_2 = {"rls": (2.63, 3.20, 3.79), "mrls": (0.88, 1.08, 1.10)}
TABLE_6_1 = ((0.923, 0.031, 0.174), (0.031, 1.146, -0.127), (0.174, -0.127, 1.203))
"""Error covariance over noise variance, 5.68e-9 (...) / 11.37e-9. In table 5.2 the noise column of RLS is misprinted;
the ratios are those to the noise of the MRLS column."""


def chapter_4(found: list[NoiseOrders], of_the_model: list[NoiseOrders], figures: Path) -> list[str]:
    """of_the_model: the same with noise that is ARMA(1,2)."""
    limits = [f"{white_limit(found[0].lags, *order):.1f}" for order in found[0].q]
    rows, panels = [], []
    for one, noise in [(one, "sine and white") for one in found] + [(one, "ARMA(1,2)") for one in of_the_model]:
        rows.append(
            (
                f"{one.which}, {noise}",
                *(f"{np.median(one.q[o]):.0f}" for o in one.q),
                *(f"{np.mean(one.white[o]):.0%}" for o in one.q),
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
        "white 0,0",
        "1,2",
        "lags in limit 0,0",
        "1,2",
        "error of K/M 0,0",
        "1,2",
        "apart, sigma",
        "within 2 sigma",
    )
    draw(figures / "chapter_4.png", panels, columns=3)
    return [
        "## 4.5.1 Noise models: p,q = 0,0 and 1,2", "",
        f"One mass, C/M = 1, 13.3 m/s, 80 samples; noise 10 sin(0.3 t) and random of variance 10. Recursive "
        f"Gauss-Newton with a memory of {GAUSS_NEWTON['memory'] * 1e3:g} ms, "
        f"{GAUSS_NEWTON['noise_memory'] * 1e3:g} ms for the noise model; with 1,2 it goes over the record {PASSES} "
        "times, "
        "each from the noise model that the one before ended with (5.3: \"an iterative estimation method is "
        "required\"). "
        f"Q is Ljung and Box's over {found[0].lags} lags, a quarter of the samples, less p + q degrees of freedom; "
        "below "
        f"{limits[0]} (0,0) and {limits[1]} (1,2) the innovation passes for white at 95 %.", "",
        markdown_table(head, rows), "",
        "*Apart*: median over time of |difference of the two K/M| over its sigma; *within*: share of the time (from "
        f"{SETTLED * 1e3:g} ms on) within two; of two normal variables of that sigma they would be 0.67 and 95 %. "
        "*Error of K/M*: rms, 1/s^2, of about 600.", "",
        "As in the thesis, the residual of 0,0 is far from white and both orders find the same K/M within their "
        "sigmas, "
        "because the residual does not go along with the inputs.", "",
        "Which noise: in 4.5.1 the thesis adds a sine and white noise to the simulated acceleration, by its words, "
        "and says that the residual of 0,0 is autocorrelated; that the residual of 1,2 is white it does not say. "
        "By 4.1 and 4.12 the equation error is an ARMA(p,q) process, so the last rows have the same experiment with "
        "noise "
        "that is one. There 1,2 leaves it white. A sine plus white noise is no ARMA(1,2): it is ARMA(2,2) with all "
        "roots on the unit circle, which takes longer than 80 samples to be told. ARMA(1,2) fitted by least squares to "
        "that noise alone, without any car, passes in 8 % of 40 repetitions of 81 samples, and the recursion with "
        "2,2 in "
        "about half. So with the thesis's noise 1,2 takes most of the autocorrelation away (Q, *lags in limit*), "
        "not all of it.", "",
        "![noise models](thesis/chapter_4.png)", "",
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
    return [
        Panel(f"K/M {one.which} (figures 4.4, 4.6)", "time in ms", "1/s^2", k, y_range=(0.0, 1200.0)),
        Panel("auto-correlation of the innovation", "lag, samples", "", correlation, limits, y_range=(-1.05, 1.05)),
        Panel("cross-correlation with the crush", "lag, samples", "", crush, cross_limits, y_range=(-1.05, 1.05)),
    ]


def chapter_5(frontal: Ratios, side: Ratios, others: dict[str, Ratios], figures: Path) -> list[str]:
    page = [
        "## 5.6.1 RLS and MRLS", "",
        "Error variance over noise variance, in every equation; the error is that of the output with the updated "
        "parameters, "
        "as in tables 5.1 and 5.2.", "",
    ]  # fmt: skip
    for title, found, table, settings in (
        ("frontal (table 5.1)", frontal, TABLE_5_1, FRONTAL),
        ("side (table 5.2)", side, TABLE_5_2, SIDE),
    ):
        rows = []
        for k, name in enumerate(found.equations):
            rls, mrls = found.median("rls")[k], found.median("mrls")[k]
            low, high = np.quantile(found.by_method["mrls"][:, k], [0.1, 0.9])
            theirs = [f"{table[m][k]:.2f}" for m in ("rls", "mrls")]
            rows.append(
                (
                    f"{title}: {name}",
                    *theirs,
                    f"{rls:.2f}",
                    f"{mrls:.2f}",
                    f"{low:.2f} to {high:.2f}",
                    f"{rls / mrls:.1f}",
                )
            )
        head = ("case: equation", "thesis RLS", "thesis MRLS", "RLS", "MRLS", "MRLS, 10 to 90 % of seeds", "RLS / MRLS")
        page += [markdown_table(head, rows), "", f"Settings: {_said(settings)}.", ""]
    rows = [
        (case, *(f"{value:.2f}" for m in ("rls", "mrls") for value in found.median(m)))
        for case, found in others.items()
    ]
    head = ("other conditions, equations 1 to 3", *(f"{m} {k}" for m in ("RLS", "MRLS") for k in (1, 2, 3)))
    page += [
        "Masses, dampings, K3, forgetting and m are those of table 5.3, the error limit is its sigma / sqrt(m). "
        "Its cr of 50 and 20 "
        "is not: on these curves so large a correction overshoots (the last rows), so cr is 3. The sharper the change, "
        "the more its "
        "first sample weighs, which no recursion can know of:", "",
        markdown_table(head, rows), "",
    ]  # fmt: skip
    panels = _parameters(frontal, cases.frontal(), "frontal", "figure 5.4") + _parameters(
        side, cases.side(), "side", "figure 5.8"
    )
    draw(figures / "chapter_5.png", panels)
    draw(figures / "chapter_5_outputs.png", _outputs(frontal, "figure 5.5") + _outputs(side, "figure 5.9"), columns=3)
    return page + [
        "![parameters](thesis/chapter_5.png)",
        "",
        "![outputs](thesis/chapter_5_outputs.png)",
        "",
        *_table_5_4(frontal, side),
    ]


def _said(settings: dict) -> str:
    return ", ".join(f"{name} {value:g}" for name, value in settings.items())


def _parameters(found: Ratios, scenario, case: str, figure: str) -> list[Panel]:
    panels = []
    for element in scenario.system.elements:
        index = found.example["rls"].description.elements.index(element.name)
        if f"{element.name}.stiffness" not in _estimated(found):
            continue
        crush = np.array([e.crush[index] for e in found.example["rls"].estimates])
        lines = []
        for method, result in found.example.items():
            column = result.description.parameters.index(f"{element.name}.stiffness")
            value = np.array([e.parameters[column] for e in result.estimates]) * 1e-3
            lines.append(Line(crush * 1e3, value, method))
        grid = np.linspace(0.0, crush.max(), 300)
        truth = np.array([element.spring.stiffness(x) for x in grid]) * 1e-3
        lines.append(Line(grid * 1e3, truth, "assumed", "#222222", "--"))
        panels.append(
            Panel(f"{case}, {element.name} ({figure})", "crush in mm", "kN/m", lines, y_range=(0.0, 1.6 * truth.max()))
        )
    return panels


def _estimated(found: Ratios) -> set[str]:
    last = found.example["mrls"].estimates[-1]
    return {name for name, status in zip(found.example["mrls"].description.parameters, last.status) if status != 1}


def _outputs(found: Ratios, figure: str) -> list[Panel]:
    panels = []
    for k, name in enumerate(found.equations):
        time = np.array([e.time_ns for e in found.example["rls"].estimates]) * 1e-6
        measured = np.array([e.measured[k] for e in found.example["rls"].estimates])
        lines = [Line(time, measured, "with noise", "#aaaaaa")]
        lines += [Line(time, np.array([e.predicted[k] for e in r.estimates]), m) for m, r in found.example.items()]
        unit = found.example["rls"].description.equation_units[k]
        panels.append(Panel(f"{name} ({figure})", "time in ms", unit, lines))
    return panels


def _table_5_4(frontal: Ratios, side: Ratios) -> list[str]:
    """Cross-correlation of the error with the inputs, lag 0, first repetition."""
    rows = []
    for case, found, model in (("frontal", frontal, "frontal"), ("side", side, "side")):
        structure = load_model(FOLDER / f"{model}.yaml")
        for method, result in found.example.items():
            judged = validate(structure, result.description, result.estimates)
            for equation in judged.equations:
                cells = [f"{name} {c.values[len(c.values) // 2]:+.2f}" for name, c in equation.cross.items()]
                rows.append((f"{case} {equation.equation}", method, ", ".join(cells)))
    return [
        "Cross-correlation of the error with the inputs at lag 0, first repetition (table 5.4):", "",
        markdown_table(("error of", "method", "with"), rows), "",
    ]  # fmt: skip


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
        f"Largest off-diagonal element of a repetition over its mean diagonal: median {np.median(away):.2f}. "
        "With the zero offsets' errors estimated too (`offsets`, our default) the diagonal is "
        + ", ".join(f"{x:.2f}" for x in np.diag(np.median(with_offsets.ratio, axis=0)))
        + ": a wrong zero, integrated twice, need not be explained by a stiffness.", "",
        "![dummy](thesis/chapter_6.png)", "",
    ]  # fmt: skip
