"""6.4.4 and 6.5: two tests with padding and two without, their characteristics, free runs and forces by load path."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from crash_replay.synthetic.recordings import SCENARIOS

from ..core.characteristic import Characteristic, characteristics
from ..core.compare_free_run import Comparison, compare
from ..core.compare_tests import curve_difference
from ..core.free_run import free_run
from ..figures import Line, Panel, draw, markdown_table
from ..model_file import load_model
from .experiments import Run, estimate

TESTS = {
    "#1": ("side_dummy_padded", 1),
    "#2": ("side_dummy_padded", 2),
    "#3": ("side_dummy_unpadded", 3),
    "#4": ("side_dummy_unpadded", 4),
}  # noqa: E501
END = 0.06  # s
FELT = 1.0e3  # N: from here on a force counts as begun
TABLE_6_2 = {
    "#1": (8.4327, 0.8439, -0.5957),
    "#2": (7.0254, 1.7392, 1.4505),
    "#3": (2.4976, -2.5932, 12.2869),
    "#4": (2.1044, -1.6198, 6.7379),
}  # noqa: E501
"""Off the diagonal: rib and pelvis, rib and spine, pelvis and spine."""
DIAGONAL_6_2 = {
    "#1": (15.3673, 13.1813, 6.3996),
    "#2": (8.2671, 10.9763, 3.8008),
    "#3": (13.5790, 17.9818, 22.2811),
    "#4": (10.5385, 12.4151, 18.1498),
}  # noqa: E501
PATHS = {"door_rib": "upper door", "door_pelvis": "lower door", "car_pelvis": "car"}
SPINE = {"rib_spine": "rib", "pelvis_spine": "pelvis"}


class Padding(NamedTuple):
    laws: dict[str, tuple[Characteristic, ...]]  # by test
    runs: dict[str, Run]
    true_peaks: dict[str, np.ndarray]  # (5,) N, each element's largest force
    began: dict[str, dict[str, float]]  # s, by test and element: the force passes FELT
    free: dict[str, list[Comparison]]
    residual: dict[str, np.ndarray]  # (3, 3) correlation of the error

    def peak(self, test: str, element: str) -> float:
        """N, largest estimated force."""
        k = self.runs[test].description.elements.index(element)
        return max(e.force[k] for e in self.runs[test].estimates if 0 < e.time_ns <= END * 1e9)

    def apart(self, one: str, other: str, element: int) -> float:
        """Share of the peak force between the curves of two tests."""
        return curve_difference(self.laws[one][element], self.laws[other][element])


def padding() -> Padding:
    structure = load_model("side_dummy")
    laws, runs, peaks, began, free, residual = {}, {}, {}, {}, {}, {}
    for test, (name, seed) in TESTS.items():
        recording, truth = SCENARIOS[name](seed)
        run = runs[test] = estimate(structure, recording, "constrained_kalman")
        laws[test] = characteristics(structure, run.description, run.estimates)
        during = (truth.time_ns > 0) & (truth.time_ns <= END * 1e9)
        names = run.description.elements
        peaks[test] = np.array([truth.elements[n].force[during].max() for n in names])
        time = np.array([e.time_ns for e in run.estimates]) * 1e-9
        force = np.array([e.force for e in run.estimates])
        felt = [time[(force[:, k] > FELT) & (time > 0.0)] for k in range(len(names))]
        began[test] = {n: float(when[0]) if len(when) else np.nan for n, when in zip(names, felt)}
        simulated = free_run(structure, run.description, run.estimates, end=END)
        free[test] = compare(structure, run.description, simulated)[:3]
        error = np.array([e.residual for e in run.estimates if 0 < e.time_ns <= END * 1e9])
        residual[test] = np.corrcoef(error, rowvar=False)
    return Padding(laws, runs, peaks, began, free, residual)


def section(found: Padding, figures: Path) -> list[str]:
    names = found.runs["#1"].description.elements
    rows = []
    for k, name in enumerate(names):
        peaks = [f"{found.peak(t, name) * 1e-3:.1f} ({found.true_peaks[t][k] * 1e-3:.1f})" for t in ("#1", "#3")]
        begun = [_ms(found.began[t][name]) for t in ("#1", "#3")]
        alike = f"{found.apart('#1', '#2', k):.1%}, {found.apart('#3', '#4', k):.1%}"
        rows.append((name, *peaks, *begun, alike, f"{found.apart('#1', '#3', k):.1%}"))
    runs = [
        (t, *(f"{c.rating.overall:.2f} {c.rating.grade}; {c.simulated_peak / c.measured_peak - 1.0:+.0%}"
              for c in found.free[t]))
        for t in ("#1", "#3")
    ]  # fmt: skip
    _draw(found, figures)
    upper, lower = ([found.peak(t, e) * 1e-3 for t in ("#1", "#3")] for e in ("door_rib", "door_pelvis"))
    return [
        "## 6.4.4, 6.5 Padded and unpadded: characteristics, free runs, forces by load path", "",
        "Two simulated tests with 50 mm of padding (#1, #2) and two without (#3, #4), 1 g of noise and zero "
        "offsets, constrained Kalman filter. Peak forces in kN, in brackets the true ones; *begins*: the force "
        "passes 1 kN; *alike*: rms difference of the two curves of like tests, share of the peak; *apart*: of #1 "
        "and #3.", "",
        markdown_table(
            ("element", "peak #1", "peak #3", "begins #1, ms", "#3, ms", "alike #1 #2, #3 #4", "apart"), rows
        ), "",
        "The thesis's statements: \"all five force deflection characteristics correlate well for similar cars\" "
        f"(alike); with padding \"the force starts increasing earlier\" ({found.began['#1']['door_rib'] * 1e3:.1f} "
        f"against {found.began['#3']['door_rib'] * 1e3:.1f} ms at the rib, "
        f"{found.began['#1']['door_pelvis'] * 1e3:.1f} against {found.began['#3']['door_pelvis'] * 1e3:.1f} at the "
        "pelvis); \"the peak force for the padded interface is lower\"; \"the dummy crush characteristics for the "
        "rib to spine for all four tests are close\"; the force through the lower load path is higher than through "
        f"the upper one ({lower[0]:.1f} against {upper[0]:.1f} kN padded, {lower[1]:.1f} against {upper[1]:.1f} "
        "unpadded). Its drop of the pelvis to spine force it lays to a dummy that turns, which ours does not.", "",
        "Free runs (figures 6.13, 6.14), rating of the acceleration and error of its peak:", "",
        markdown_table(("test", *(c.name for c in found.free["#1"])), runs), "",
        "Correlation of the errors, rib and pelvis, rib and spine, pelvis and spine (from table 6.2, in normalised "
        "units):", "",
        markdown_table(("test", "thesis", "ours"), [(t, _thesis(t), _ours(found.residual[t])) for t in TESTS]), "",
        "Simulated sensors' noise is independent, so ours are near 0; what a model along one axis leaves of a "
        "turning dummy is not.", "",
        "![padding](thesis/padding.png)", "",
    ]  # fmt: skip


def _ms(time: float) -> str:
    return f"{time * 1e3:.1f}" if np.isfinite(time) else "never"


def _thesis(test: str) -> str:
    a, b, c = DIAGONAL_6_2[test]
    scale = np.sqrt([a * b, a * c, b * c])
    return ", ".join(f"{x:+.2f}" for x in np.array(TABLE_6_2[test]) / scale)


def _ours(r: np.ndarray) -> str:
    return ", ".join(f"{x:+.2f}" for x in (r[0, 1], r[0, 2], r[1, 2]))


def _draw(found: Padding, figures: Path) -> None:
    panels = []
    for k, name in enumerate(found.runs["#1"].description.elements):
        lines = [Line(laws[k].crush * 1e3, laws[k].force * 1e-3, test) for test, laws in found.laws.items()]
        panels.append(Panel(f"{name} (figure 6.12)", "crush in mm", "kN", lines))
    for title, paths in (("on the dummy (figure 6.15)", PATHS), ("on the spine (figure 6.16)", SPINE)):
        lines = []
        for name, said in paths.items():
            for test, kind in (("#1", "padded"), ("#3", "unpadded")):
                run = found.runs[test]
                k = run.description.elements.index(name)
                after = [e for e in run.estimates if 0 <= e.time_ns <= END * 1e9]
                time = np.array([e.time_ns for e in after]) * 1e-6
                lines.append(Line(time, np.array([e.force[k] for e in after]) * 1e-3, f"{said}, {kind}"))
        panels.append(Panel(f"Forces {title}", "time in ms", "kN", lines))
    draw(figures / "padding.png", panels, columns=3)
