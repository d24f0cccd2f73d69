"""`thesis --to docs`: run the thesis's simulated experiments again and write docs/thesis.md with its figures."""

import sys
from pathlib import Path

import numpy as np

from crash_replay.fault import guarded
from crash_replay.output import check_outputs, written_into
from crash_replay.said import Parser, say

from ..core.structure import ModelError
from ..core.validation import chi_square_quantile
from ..figures import Line, Panel, draw, markdown_table, write_markdown
from . import cases, design_cases, door_and_dummy, future_work, jumps_first, measured, model_reduction, padding, printed
from . import side_impact as distribution
from .chapter_5 import chapter_5
from .chapters import chapter_4, chapter_6
from .experiments import FRONTAL, SIDE, Alike, Sampling, alike, dummy, noise_orders, ratios, sampling

FEWEST_SEEDS, SEEDS = 20, 20


def main() -> None:
    sys.exit(guarded(_command))


def _command() -> None:
    parser = Parser(prog="thesis", description=__doc__.partition(": ")[2])
    parser.add_argument("--to", default="docs", metavar="DIR", help="folder of thesis.md; figures go to its thesis/")
    parser.add_argument(
        "--data", type=Path, help="folder with cyberdiver/ and nhtsa-10146/, measured tests; none: left out"
    )
    parser.add_argument("--seeds", type=int, default=SEEDS, help=f"noisy repetitions, at least {FEWEST_SEEDS}")
    arguments = parser.parse_args()
    write_page(Path(arguments.to), arguments.seeds, arguments.data)


def write_page(folder: Path, seeds: int, data: Path | None = None) -> None:
    if seeds < FEWEST_SEEDS:
        raise ModelError(f"medians over fewer than {FEWEST_SEEDS} seeds say little, got --seeds {seeds}")
    check_outputs({"--to": folder / "thesis.md"}, [])
    with written_into(folder / "thesis") as figures:
        page = _page(seeds, figures, data)
        count = len(list(figures.iterdir()))
    path = write_markdown(folder / "thesis.md", page)
    say(f"{path} and {count} figures in {folder / 'thesis'}")


def _page(seeds: int, figures: Path, data: Path | None) -> list[str]:
    page = [HEAD.format(seeds=seeds)]
    thesis, of_the_model = (
        [noise_orders(which, seeds, noise=noise) for which in cases.CHAPTER_4]
        for noise in (cases.vibrating, cases.arma)
    )
    page += chapter_4(thesis, of_the_model, figures)
    frontal, side = ratios(cases.frontal(), "frontal", FRONTAL, seeds), ratios(cases.side(), "side", SIDE, seeds)
    others = {
        "frontal, all noise 0.37": ratios(cases.frontal(shares=cases.EQUAL), "frontal", FRONTAL, seeds),
        "side, all noise 0.37": ratios(cases.side(shares=cases.EQUAL), "side", SIDE, seeds),
        "frontal, K changes within 2 mm": ratios(cases.frontal(step=0.002), "frontal", FRONTAL, seeds),
        "side, K changes within 2 mm": ratios(cases.side(step=0.002), "side", SIDE, seeds),
        "as printed: frontal, cr 50, steps of at most 2 % of the scale": ratios(
            cases.frontal(), "frontal", FRONTAL | {"cr": 50.0, "step_limit": 0.02, "preset": "thesis"}, seeds
        ),
        "as printed: side, cr 20, steps of at most 5 % of the scale": ratios(
            cases.side(), "side", SIDE | {"cr": 20.0, "step_limit": 0.05, "preset": "thesis"}, seeds
        ),
        "frontal, cr 50, steps of at most 2 % of the scale": ratios(
            cases.frontal(), "frontal", FRONTAL | {"cr": 50.0, "step_limit": 0.02}, seeds
        ),
        "side, cr 20, steps of at most 5 % of the scale": ratios(
            cases.side(), "side", SIDE | {"cr": 20.0, "step_limit": 0.05}, seeds
        ),
    }
    page += chapter_5(frontal, side, others, figures)
    page += chapter_6(dummy(seeds), dummy(seeds, offsets=True), figures)
    page += rates(sampling(5), figures)
    page += jumps_first.section(jumps_first.jumps_first(5), figures)
    page += distribution.section(distribution.side_impact(seeds), figures)
    page += model_reduction.section(model_reduction.reduction(seeds), figures)
    page += door_and_dummy.section(door_and_dummy.separation(), figures)
    page += padding.section(padding.padding(), figures)
    page += design_cases.section(design_cases.cases(5), figures)
    page += future_work.section(future_work.future_work(5))
    page += twins(alike(5))
    page += measured.section(measured.measured(data / "nhtsa-10146") if data else None, figures)
    return page + printed.section(data)


HEAD = """\
# The thesis's simulated experiments, run again

U. N. Gandhi, *Application of system identification in analysis of automobile crash*, University of Michigan, 1993.
Made by `make thesis`; the simulated tests come from `crash_replay.synthetic`, which shares no formula with the
estimators. Every number is a median over {seeds} noisy repetitions unless it says otherwise. Sampling is 1 ms in
chapters 4 and 5. In chapter 5 the noise has the shares of each output's standard deviation that tables 5.1 and 5.2
have: 0.375, 0.404 and 0.301 (frontal: car, engine, barrier force), 0.382, 0.293 and 0.198 (side: barrier, door, car).
Where the thesis shows only figures, there is no number of its beside ours. The thesis's assumed stiffness curves are in
figures that its text lacks: ours change abruptly, within 20 mm of crush
([`thesis/cases.py`](../ros2_ws/src/crash_estimator/crash_estimator/thesis/cases.py)).
"""


def rates(found: Sampling, figures: Path) -> list[str]:
    rows = [
        (
            name,
            f"{np.median(values):.1%}",
            "; ".join(sorted({f"{p},{q}" for p, q in found.orders[name]})),
        )
        for name, values in found.from_truth.items()
    ]
    lines = [
        Line(crush * 1e3, force, name, "#222222" if name == "true" else "", "--" if name == "true" else "-")
        for name, (crush, force) in found.curves.items()
    ]
    draw(
        figures / "sampling.png",
        [Panel("force over crush at two sampling rates (figure 4.22)", "crush in mm", "K/M x crush in m/s^2", lines)],
        columns=1,
        height=3.2,
    )
    return [
        "## 4.5.3 Sampling", "",
        "The same test with a vibration of 300 Hz and 3 g of noise, sampled every 0.1 ms, and as means over 1 ms (5 "
        "repetitions). Orders p,q of the noise model by Schwarz's criterion, force over crush against the truth.", "",
        markdown_table(("sampling", "rms difference from the true force, of its peak", "p,q chosen"), rows), "",
        f"Between the two curves: {np.median(found.between):.1%}. For a slowly changing parameter 1 ms is enough, as "
        "the thesis concludes. At 0.1 ms every repetition asks for a noise model with a moving-average part; with "
        "the 80 samples at 1 ms the criterion has little to go by.", "",
        "![sampling](thesis/sampling.png)", "",
    ]  # fmt: skip


def twins(found: Alike) -> list[str]:
    rows = []
    for name, differences in (
        (f"the same car, ringing at {found.rings[0]:.0f} Hz", found.same),
        (f"another mount, ringing at {found.rings[1]:.0f} Hz", found.other),
    ):
        ones = [d[0] for d in differences]
        rows.append(
            (
                name,
                f"{np.median([d.chi_square for d in ones]):.1f}",
                f"{np.mean([d.differs(0.95) for d in ones]):.0%}",
                f"{np.median([d.spectral_distance for d in ones]):.1f}",
                f"{np.median([d.loudest[0] for d in ones]):.0f}",
            )
        )
    limit = chi_square_quantile(0.95, found.same[0][0].degrees)
    head = ("second test is of", "chi square", "said to differ", "spectra apart, dB", "most at, Hz")
    return [
        "## 7.3 Two alike tests by their noise models", "",
        f"AR(2) noise models of two tests, 10 kHz, 5 pairs; above {limit:.1f} the coefficients differ at 95 %. The "
        "ringing is that of the noise model's roots in continuous time (3.5.2, indirect); 1090 and 1513 Hz were put "
        "in.", "",
        markdown_table(head, rows), "",
    ]  # fmt: skip


if __name__ == "__main__":
    main()
