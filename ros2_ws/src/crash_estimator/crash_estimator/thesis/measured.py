"""4.5.2 and 5.6.2 in kind on a measured test, NHTSA 10146: a 2018 sedan into a barrier at 57 km/h, sampled at 1 ms."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from crash_replay.readers import read_source
from crash_replay.recording import Recording

from ..core.compare_free_run import compare
from ..core.compare_tests import coarser
from ..core.errors import equation_errors
from ..core.free_run import free_run
from ..core.validation import validate
from ..figures import Line, Panel, draw, markdown_table
from ..model_file import load_model
from .experiments import Run, estimate, in_passes

END = 0.1  # s
ORDERS = ((0, 0), (1, 2), (3, 4))
GAUSS_NEWTON: dict[str, Any] = {"memory": 0.01, "noise_memory": 0.1}
TEST_DATA = {  # table 5.1, test data: error variance over that of the input
    "cab": (1.458 / 2.237, 1.583 / 2.237),
    "engine": (3.805 / 6.138, 1.257 / 6.138),
    "barrier": (2.116 / 6.352, 0.8355 / 6.352),
}  # fmt: skip
CHAPTER_5 = {"rls": {"forgetting": 0.6}, "mrls": {"forgetting": 0.6, "m": 3, "error_limit": 1.0, "step_limit": 0.5}}
"""Forgetting and m of table 5.3, frontal test."""


class Measured(NamedTuple):
    mass: Run
    jumps: list[float]  # s, by AFMM on the samples as recorded
    turned: float  # s, where the car's velocity changes its sign
    orders: dict[tuple[int, int], Run]
    inside: dict[tuple[int, int], tuple[float, ...]]  # lags in the 99 % limit: auto, with crush, with rate
    ratings: dict[tuple[int, int], tuple[float, float]]  # free run: acceleration, velocity
    force: dict[tuple[int, int], tuple[float, float]]  # of the barrier force: rms difference of K X, correlation
    shares: dict[str, np.ndarray]  # rls, mrls -> (3,) error variance over that of the input


def until(recording: Recording, end: float = END) -> Recording:
    keep = recording.time < end
    return Recording(recording.test, recording.time_ns[keep], recording.values[keep])


def measured(folder: Path) -> Measured:
    raw = read_source(folder)
    recording = until(coarser(raw, 1e-3))
    single, double = load_model("frontal_single"), load_model("frontal_engine_cab")
    bank = estimate(single, until(raw, 0.13), "afmm")
    jumps = [float(e.text.split("jumped at ")[1].split(" ms")[0]) * 1e-3
             for one in bank.estimates for e in one.events if e.kind == "jump"]  # fmt: skip
    velocity = np.array([e.velocity[0] for e in bank.estimates])
    turned = float(np.array([e.time_ns for e in bank.estimates])[np.argmax(velocity < 0.0)] * 1e-9)
    orders, inside, ratings, force = {}, {}, {}, {}
    for order in ORDERS:
        run = orders[order] = in_passes(single, recording, *order, **GAUSS_NEWTON)
        judged = validate(single, run.description, run.estimates, what="innovation", start=0.005).equations[0]
        inside[order] = judged.auto.inside(0.99), *(c.inside(0.99) for c in judged.cross.values())
        compared = compare(single, run.description, free_run(single, run.description, run.estimates, end=END))
        ratings[order] = compared[0].rating.overall, compared[-1].rating.overall
        after = [e for e in run.estimates if e.time_ns > 0]
        spring = np.array([e.parameters[0] * e.crush[0] for e in after])
        barrier = np.array([e.measured[-1] for e in after])
        force[order] = (
            float(np.sqrt(np.mean((spring - barrier) ** 2)) / np.abs(barrier).max()),
            float(np.corrcoef(spring, barrier)[0, 1]),
        )  # fmt: skip
    shares = {}
    for method, settings in CHAPTER_5.items():
        run = estimate(double, recording, method, **settings)
        shares[method] = np.array(
            [e.error_variance / e.input_variance for e in equation_errors(run.description, run.estimates)]
        )
    mass = estimate(double, recording, "effective_mass")
    return Measured(mass, jumps, turned, orders, inside, ratings, force, shares)


def section(found: Measured | None, figures: Path) -> list[str]:
    title = "## 4.5.2, 5.6.2 A measured test, in kind: NHTSA 10146"
    if found is None:
        return [
            title,
            "",
            "The recording does not come with the project and was not at hand: `make thesis DATA=FOLDER`.",
            "",
        ]
    mass = found.mass.estimates[-1]
    rows = [
        (f"{p},{q}", *(f"{x:.0%}" for x in found.inside[p, q]), *(f"{x:.2f}" for x in found.ratings[p, q]),
         f"{found.force[p, q][0]:.0%}", f"{found.force[p, q][1]:.2f}")
        for p, q in found.orders
    ]  # fmt: skip
    tests = [
        (
            name,
            *(f"{x:.2f}" for x in TEST_DATA[name]),
            f"{found.shares['rls'][k]:.2f}",
            f"{found.shares['mrls'][k]:.2f}",
        )
        for k, name in enumerate(TEST_DATA)
    ]
    said = ", ".join(f"{n.split('.')[0]} {m:.0f} +- {s:.0f} kg" for n, m, s in zip(
        found.mass.description.parameters, mass.parameters, mass.std))  # fmt: skip
    rebound = min(found.jumps, key=lambda t: abs(t - found.turned), default=np.nan)
    _draw(found, figures)
    return [
        title, "",
        "The thesis's measured tests are normalised and only drawn. Here its figures in kind on a 2018 sedan into a "
        "barrier at 57 km/h: means over 1 ms, 0 to 100 ms, one mass unless it says otherwise.", "",
        f"*Mass* (figures 4.11, 4.12), cab and engine by 4.3a: {said}; on the scales the car had 1719 kg.", "",
        f"*Discontinuities* (figure 4.13): the velocity changes its sign at {found.turned * 1e3:.1f} ms; AFMM on the "
        f"samples as recorded reports a jump at {rebound * 1e3:.0f} ms, and others at "
        + ", ".join(f"{t * 1e3:.0f}" for t in found.jumps if t != rebound) + " ms. The thesis: at t/t0 = 80, where the "
        "velocity is zero, and no other major one.", "",
        "*K and C by Gauss-Newton* (figures 4.14 to 4.20), lags of the residual's correlations within the 99 % "
        "limit, rating of the free run (ISO/TS 18571), and K times crush against the measured barrier force:", "",
        markdown_table(
            ("p,q", "auto", "with crush", "with rate", "free run: acceleration", "velocity",
             "K X less barrier force, rms of peak", "correlation"), rows), "",
        "*Test data of table 5.1*: cab and engine, error variance over that of the measured signal:", "",
        markdown_table(("", "thesis RLS", "thesis MRLS", "RLS", "MRLS"), tests), "",
        "![measured](thesis/measured.png)", "",
    ]  # fmt: skip


def _draw(found: Measured, figures: Path) -> None:
    run = found.orders[1, 2]
    after = [e for e in run.estimates if e.time_ns > 0]
    time = np.array([e.time_ns for e in after]) * 1e-6
    spring = np.array([e.parameters[0] * e.crush[0] for e in after]) * 1e-3
    barrier = np.array([e.measured[-1] for e in after]) * 1e-3
    kilograms = np.array([e.parameters for e in found.mass.estimates if e.time_ns > 0])
    accelerations = [
        Line(time, np.array([e.measured[0] for e in after]), "measured", "#aaaaaa"),
        Line(time, np.array([e.predicted[0] for e in after]), "estimated, 1,2"),
    ]
    names = [n.split(".")[0] for n in found.mass.description.parameters]
    draw(figures / "measured.png", [
        Panel("mass (figure 4.12)", "time in ms", "kg", [Line(time, kilograms[:, k], n) for k, n in enumerate(names)],
              y_range=(-500.0, 3000.0)),
        Panel("force (figure 4.15)", "time in ms", "kN", [Line(time, barrier, "barrier, measured", "#aaaaaa"),
                                                          Line(time, spring, "K X")]),
        Panel("acceleration (figure 4.16)", "time in ms", "m/s^2", accelerations),
    ], columns=3)  # fmt: skip
