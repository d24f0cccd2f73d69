"""Chapter 5 of the page: tables 5.1, 5.2 and 5.4 beside ours, RLS and MRLS as we have them and as printed."""

from pathlib import Path

import numpy as np

from ..figures import Line, Panel, draw, markdown_table
from . import cases
from .experiments import FRONTAL, SIDE, Ratios

TABLE_5_1 = {"rls": (1.47, 0.83, 1.46), "mrls": (0.94, 0.79, 0.90)}
TABLE_5_2 = {"rls": (2.63, 3.20, 3.79), "mrls": (0.88, 1.08, 1.10)}
"""Error variance over noise variance. In table 5.2 the noise column of RLS is misprinted; the ratios are those to the
noise of the MRLS column."""
MEANS_5_1 = {"noise": (9.601, -3.692, 5.606), "rls": (51.01, 7.422, -46.91), "mrls": (9.883, -0.1798, 1.813)}
MEANS_5_2 = {"noise": (-0.2294, -0.4173, -0.4757), "rls": (0.7636, 6.932, 8.818), "mrls": (0.05571, 0.4442, -1.622)}
SIGMAS = {"frontal": np.sqrt([3094.0, 1370.0, 4328.0]), "side": np.sqrt([118.8, 333.7, 187.2])}
"""Of the noise in the simulated data, by which means are divided."""
TABLE_5_4: dict[str, dict[str, dict[str, tuple[float | None, ...]]]] = {  # error of, method -> with the inputs
    "frontal": {
        "barrier": {"rls": (-0.1311, 0.0291, -0.1730, 0.0170, 0.1274, 0.0019),
                    "mrls": (-0.0206, -0.0122, -0.0315, -0.0195, 0.0456, 0.0309)},
        "cab": {"rls": (0.1384, -0.0587, 0.1720, -0.0497, -0.0730, 0.0356),
                "mrls": (-0.0552, 0.0682, -0.0496, 0.0684, -0.0816, -0.0686)},
        "engine": {"rls": (-0.0884, 0.0756, -0.0874, 0.0769, -0.0840, -0.0790),
                   "mrls": (0.0063, -0.0615, -0.0132, -0.0574, 0.1194, 0.0509)},
    },
    "side": {  # with X1-X2, X2-X3, V1-V2, V2-V3
        "car": {"rls": (-0.0696, -0.5679, 0.4620, 0.5890), "mrls": (0.1397, -0.3711, -0.065, 0.0626)},
        "mdb": {"rls": (0.5892, -0.385, 0.3638, 0.5298), "mrls": (0.1954, -0.2032, 0.0671, 0.1408)},
        "door": {"rls": (-0.0985, 0.4725, -0.5203, -0.6414), "mrls": (0.0668, None, 0.1022, 0.0895)},
    },
}  # fmt: skip
"""Of MRLS's door with X2-X3 the value is missing in the thesis's text."""
INPUTS = {
    "frontal": {"X1": "cab_barrier.crush", "V1": "cab_barrier.rate", "X2": "engine_barrier.crush",
                "V2": "engine_barrier.rate", "X1-X2": "cab_engine.crush", "V1-V2": "cab_engine.rate"},
    "side": {"X1-X2": "mdb_door.crush", "X2-X3": "door_car.crush", "V1-V2": "mdb_door.rate", "V2-V3": "door_car.rate"},
}  # fmt: skip


def chapter_5(frontal: Ratios, side: Ratios, others: dict[str, Ratios], figures: Path) -> list[str]:
    page = [
        "## 5.6.1 RLS and MRLS", "",
        "Error variance over noise variance, in every equation; the error is that of the output with the updated "
        "parameters, as in tables 5.1 and 5.2.", "",
    ]  # fmt: skip
    for title, found, table, settings in (
        ("frontal (table 5.1)", frontal, TABLE_5_1, FRONTAL),
        ("side (table 5.2)", side, TABLE_5_2, SIDE),
    ):
        rows: list[tuple[str, ...]] = []
        for k, name in enumerate(found.equations):
            rls, mrls = found.median("rls")[k], found.median("mrls")[k]
            low, high = np.quantile(found.by_method["mrls"][:, k], [0.1, 0.9])
            theirs = [f"{table[m][k]:.2f}" for m in ("rls", "mrls")]
            printed = [f"{found.median(m)[k]:.2f}" for m in ("rls as printed", "mrls as printed")]
            rows.append(
                (
                    f"{title}: {name}",
                    *theirs,
                    f"{rls:.2f}",
                    f"{mrls:.2f}",
                    f"{low:.2f} to {high:.2f}",
                    f"{rls / mrls:.1f}",
                    *printed,
                )
            )
        head = (
            "case: equation",
            "thesis RLS",
            "thesis MRLS",
            "RLS",
            "MRLS",
            "MRLS, 10 to 90 % of seeds",
            "RLS / MRLS",
            "RLS as printed",
            "MRLS as printed",
        )
        page += [markdown_table(head, rows), "", f"Settings: {_said(settings)}.", ""]
    more = [
        (case, *(_ratio(value) for m in ("rls", "mrls") for value in found.median(m))) for case, found in others.items()
    ]
    titles = ("other conditions, equations 1 to 3", *(f"{m} {k}" for m in ("RLS", "MRLS") for k in (1, 2, 3)))
    page += [
        "Masses, dampings, K3, forgetting and m are those of table 5.3, the error limit is its sigma / sqrt(m). Its "
        "cr of 50 and 20 is not: on these curves so large a correction overshoots (the last rows), so cr is 3. The "
        "sharper the change, the more its first sample weighs, which no recursion can know of:", "",
        markdown_table(titles, more), "",
    ]  # fmt: skip
    panels = _parameters(frontal, cases.frontal(), "frontal", "figure 5.4") + _parameters(
        side, cases.side(), "side", "figure 5.8"
    )
    draw(figures / "chapter_5.png", panels)
    draw(figures / "chapter_5_outputs.png", _outputs(frontal, "figure 5.5") + _outputs(side, "figure 5.9"), columns=3)
    return (
        page
        + _means(frontal, side)
        + [
            "![parameters](thesis/chapter_5.png)",
            "",
            "![outputs](thesis/chapter_5_outputs.png)",
            "",
            *_table_5_4(frontal, side),
        ]
    )


def _ratio(value: float) -> str:
    return f"{value:.2f}" if value < 1000.0 else "lost"


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


def _means(frontal: Ratios, side: Ratios) -> list[str]:
    """Means of tables 5.1 and 5.2."""
    rows = []
    for title, case, found, table in (
        ("frontal (table 5.1)", "frontal", frontal, MEANS_5_1), ("side (table 5.2)", "side", side, MEANS_5_2),
    ):  # fmt: skip
        for k, name in enumerate(found.equations):
            theirs = [f"{table[what][k] / SIGMAS[case][k]:+.2f}" for what in ("noise", "rls", "mrls")]
            ours = [f"{np.median(found.means[method][:, k]):+.2f}" for method in ("rls", "mrls")]
            rows.append((f"{title}: {name}", *theirs, *ours))
    return [
        "Mean of the error, in standard deviations of the noise (the thesis's of one repetition, whose noise has a "
        "mean of its own; ours medians):", "",
        markdown_table(("case: equation", "thesis noise", "thesis RLS", "thesis MRLS", "RLS", "MRLS"), rows), "",
    ]  # fmt: skip


def _table_5_4(frontal: Ratios, side: Ratios) -> list[str]:
    """Cross-correlation of the error with the inputs at lag 0: the thesis's / ours."""
    page = [
        "Cross-correlation of the error with the inputs at lag 0 (table 5.4), in each cell the thesis's and the "
        "median of ours. Signs of ours: crush and rate positive in compression, the barrier's force as it is pushed.",
        "",
    ]  # fmt: skip
    for case, found in (("frontal", frontal), ("side", side)):
        inputs = INPUTS[case]
        places = [found.inputs.index(name) for name in inputs.values()]
        rows = []
        for equation, by_method in TABLE_5_4[case].items():
            k = found.equations.index(equation)
            for method, theirs in by_method.items():
                ours = np.median(found.cross[method][:, k], axis=0)[places]
                cells = [f"{'?' if t is None else f'{t:+.2f}'} / {o:+.2f}" for t, o in zip(theirs, ours)]
                rows.append((f"{case} {equation}", method, *cells))
        page += [markdown_table(("error of", "method", *inputs), rows), ""]
    return page
