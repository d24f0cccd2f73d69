"""The tables of docs/methods.md: every method on the simulated recordings, where the truth is known, and on real ones.

python -m crash_estimator.thesis.evidence [--data FOLDER]      # FOLDER has cyberdiver/ and nhtsa-10146/
"""

import re
import sys
import time
from pathlib import Path

import numpy as np

from crash_replay.fault import guarded
from crash_replay.readers import read_source
from crash_replay.recording import Recording
from crash_replay.said import Parser, say
from crash_replay.synthetic.recordings import SCENARIOS

from ..core.compare_free_run import compare
from ..core.errors import equation_errors
from ..core.fold import run
from ..core.free_run import free_run
from ..core.methods import make_estimator
from ..figures import markdown_table
from ..model_file import load_model

METHODS = ("rls", "mrls", "kalman", "constrained_kalman", "gauss_newton", "afmm")
SIMULATED = {  # recording: model, end in s
    "frontal_single": ("frontal_single", 0.1),
    "frontal_engine_cab": ("frontal_engine_cab", 0.1),
    "side_mdb_door_car": ("side_mdb_door_car", 0.08),
    "side_dummy_unpadded": ("side_dummy", 0.06),
    "impactor_single": ("impactor_single", 0.04),
}
SEEDS = 3


def forces() -> str:
    """Rms error of the element forces, share of each one's true peak: the largest of a model's elements."""
    rows = []
    for name, (model, end) in SIMULATED.items():
        structure, errors = load_model(model), {method: [] for method in METHODS}
        for seed in range(SEEDS):
            recording, truth = SCENARIOS[name](seed)
            for method in METHODS:
                estimates = run(make_estimator(structure, recording.test, method), recording.samples())
                errors[method].append(max(force_errors(structure, recording, truth, estimates, end)))
        rows.append((name, *(f"{np.median(errors[method]):.1%}" for method in METHODS)))
    return markdown_table(("force error, of the peak", *METHODS), rows)


def force_errors(structure, recording: Recording, truth, estimates, end: float) -> list[float]:
    chosen = (recording.time > 0.0) & (recording.time <= end)
    found = []
    for k, element in enumerate(structure.elements):
        true = truth.elements[element.name].force[chosen]
        force = np.array([estimate.force[k] for estimate in estimates])[chosen]
        found.append(float(np.sqrt(np.mean((force - true) ** 2)) / np.abs(true).max()))
    return found


def costs() -> str:
    """Microseconds a sample through `step`, one core, cab and engine (2 unknown parameters, 3 equations)."""
    recording, _ = SCENARIOS["frontal_engine_cab"](0)
    structure, samples, row = load_model("frontal_engine_cab"), list(recording.samples()), []
    for method in (*METHODS, "gauss_newton_orders", "effective_mass"):
        estimator = make_estimator(structure, recording.test, method)
        run(estimator, samples[:600])  # compiled before the clock starts
        start = time.perf_counter()
        run(estimator, samples)
        row.append((method, f"{(time.perf_counter() - start) / len(samples) * 1e6:.0f}"))
    return markdown_table(("method", "us a sample"), row)


def linear_springs(folder: Path) -> list[tuple[Recording, float]]:
    """Undamped tests of 3 to 6 m/s (5 N/mm from 4 m/s on), each with its programmed stiffness in N/m."""
    found = []
    for path in sorted(folder.glob("linear_undamped__*.csv")):
        spring, speed = (float(x) for x in re.search(r"__(\d+)npmm_(\d)mps", path.name).groups())
        if speed > 3 or (speed == 3 and spring != 5.0):
            found.append((read_source(path), spring * 1e3))
    return found


def cyberdiver(folder: Path) -> str:
    """Stiffness against the programmed one."""
    structure, found = load_model("impactor_single"), {method: [] for method in METHODS}
    for recording, spring in linear_springs(folder):
        for method in METHODS:
            estimator = make_estimator(structure, recording.test, method)
            last = run(estimator, (sample for sample in recording.samples() if sample.time < 0.04))[-1]
            found[method].append(last.parameters[0] / spring - 1.0)
    rows = [(m, f"{np.median(x):+.1%}", f"{np.min(x):+.1%} to {np.max(x):+.1%}") for m, x in found.items()]
    return markdown_table(("method", "stiffness error, median", f"range of {len(found['rls'])} tests"), rows)


def nhtsa(folder: Path) -> str:
    """NHTSA 10146: what is explained of each signal, and the free run's rating."""
    recording, rows = read_source(folder), []
    for model in ("frontal_single", "frontal_engine_cab"):
        structure = load_model(model)
        for method in METHODS:
            estimator = make_estimator(structure, recording.test, method)
            estimates = run(estimator, (sample for sample in recording.samples() if sample.time < 0.1))
            errors = equation_errors(estimator.description, estimates)
            explained = ", ".join(f"{e.equation} {1.0 - e.error_variance / e.input_variance:.0%}" for e in errors)
            compared = compare(structure, estimator.description, free_run(structure, estimator.description, estimates))
            velocity = next(c for c in compared if c.name.endswith("velocity"))
            rows.append((f"{model}, {method}", explained, f"{velocity.rating.overall:.2f} {velocity.rating.grade}"))
    return markdown_table(("model, method", "explained", "free run's car velocity, ISO 18571"), rows)


def main() -> None:
    sys.exit(guarded(_command))


def _command() -> None:
    parser = Parser(description=__doc__.partition(":")[0])
    parser.add_argument("--data", type=Path, help="folder with cyberdiver/ and nhtsa-10146/")
    folder = parser.parse_args().data
    tables = [forces(), costs()]
    if folder:
        tables += [cyberdiver(folder / "cyberdiver"), nhtsa(folder / "nhtsa-10146")]
    say("\n\n".join(tables))


if __name__ == "__main__":
    main()
