"""`outside`: what `diagnose` says of recordings that nobody here made, beside what is true: docs/outside.md.

They do not come with the project: --data names the folder that has them.
"""

import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from time import process_time

from crash_replay.conditioning import filter_recording
from crash_replay.fault import guarded
from crash_replay.gravity import G
from crash_replay.readers import read_source
from crash_replay.recording import RecordingError
from crash_replay.said import Parser, say

from ..core.diagnosis import EFFECT_MISSING, Diagnosis, diagnose
from ..core.structure import ModelError, Structure
from ..figures import markdown_table, write_markdown
from ..model_file import load_model
from .effects_results import ONE_THREAD
from .outside_systems import Case, other_systems

HEAD = """# Recordings that nobody here made

`make benchmark-outside DATA=FOLDER`: recordings of other people's systems with a known truth, one diagnosis each,
from models that lack what is to be found. The recordings do not come with the project. Error: RMS of what is left,
in the band that the model speaks for, as given and with what was named; processor: seconds.

All of these were looked at while the verdict's two numbers were chosen (three quarters of the misfit explained, less
than half of the rest varying with time): they show what it says, and judge nothing. The two bodies dropped on water
came later, and nothing was tuned on them; the force on their nose is that of the rigid test, without the water's mass
that a nose on a spring moves along: least squares of the same two equations finds 5300 N/m for 8160, and 1020 for 1740.
"""

DAMPING_AT_RATIO_1 = 93.6
"""N s/m, of the impactor's programmed damper: 23.4 at a ratio of 0.25, 46.8 at 0.5."""


ENGINE = 400.0
"""kg, as the thesis has it for such a car."""
WITHIN_OF_DAMPER, WITHIN_OF_ENGINE = 0.1, 0.25
"""Shares of the true value that count as right."""


def cases(data: Path) -> Iterator[Case]:
    """Of what the folder has."""
    yield from other_systems(data / "outside")
    for file in sorted((data / "cyberdiver").glob("*.csv")):
        yield _impactor((file,))
    pair = [data / "cyberdiver" / f"linear_damped__15npmm_{speed}mps_025damping_trial1.csv" for speed in (4, 6)]
    if all(file.exists() for file in pair):
        yield _impactor(tuple(pair))
    car = data / "nhtsa-10146"
    if car.exists():
        yield Case("NHTSA 10146", lambda: [read_source(car)], "frontal_single", "an engine of 400 kg", _is_engine)
        filtered = lambda: [filter_recording(read_source(car), 60)]  # noqa: E731
        yield Case("NHTSA 10146, CFC 60", filtered, "frontal_single", "an engine of 400 kg", _is_engine)


def _impactor(files: tuple[Path, ...]) -> Case:
    stem = files[0].stem
    ratio = re.search(r"_(0\d+)damping", stem)
    speeds = " and ".join(re.search(r"_(\d+)mps", file.stem)[1] for file in files)
    stiffness = re.search(r"__(\d+)npmm", stem)[1]
    name = f"impactor, {stiffness} N/mm, {speeds} m/s, {'damped' if ratio else 'undamped'}"
    read = lambda: [read_source(file) for file in files]  # noqa: E731
    if not ratio:
        return Case(name, read, "impactor_spring", "no damper", lambda found: not _named(found, "viscous_damping"))
    damping = float(f"{ratio[1][0]}.{ratio[1][1:]}") * DAMPING_AT_RATIO_1
    return Case(name, read, "impactor_spring", f"a damper of {damping:.3g} N s/m", lambda f: _is_damper(f, damping))


def _named(found: Diagnosis, effect: str) -> list[float]:
    """Its coefficients, where it is named at all."""
    steps = found.steps if found.verdict == EFFECT_MISSING else ()
    return [step.coefficient for step in steps if step.effect == effect]


def _is_damper(found: Diagnosis, damping: float) -> bool:
    return any(abs(value / damping - 1.0) < WITHIN_OF_DAMPER for value in _named(found, "viscous_damping"))


def _is_engine(found: Diagnosis) -> bool:
    steps = found.steps if found.verdict == EFFECT_MISSING else ()
    return any(s.target.startswith("engine") and abs(s.coefficient / ENGINE - 1.0) < WITHIN_OF_ENGINE for s in steps)


def judged(case: Case) -> list[str]:
    """Its row of the table."""
    recordings, model = case.recordings(), case.model if isinstance(case.model, Structure) else load_model(case.model)
    began = process_time()
    try:
        found = diagnose(model, recordings)
    except (ModelError, RecordingError) as error:
        return [case.name, case.truth, f"error: {error}", "", "", "NO", f"{process_time() - began:.0f}"]
    seconds = process_time() - began
    steps = "; ".join(f"{s.effect} on {s.target} {s.coefficient:.3g} +- {s.std:.2g} {s.unit}" for s in found.steps)
    rivals = found.ranking[0].confounded_with[:3] if found.ranking else ()
    told = f"`{found.verdict}`" + (f": {steps}" if steps else "") + (f" (or {', '.join(rivals)})" if rivals else "")
    errors = f"{found.left_before.rms / G:.3g} -> {found.left.rms / G:.3g} g, {found.left.band}"
    left = f"{100.0 * found.left.of_peak:.2g} %"
    errors += f"; {more}" if (more := case.besides(found)) else ""
    return [case.name, case.truth, told, errors, left, "yes" if case.right(found) else "NO", f"{seconds:.0f}"]


def main() -> None:
    os.environ.update(ONE_THREAD)
    parser = Parser(prog="outside", description=__doc__.partition(": ")[2].partition("\n")[0])
    parser.add_argument("--data", type=Path, required=True, metavar="FOLDER")
    parser.add_argument("--to", type=Path, default=Path("docs/outside.md"), metavar="PAGE.md")
    sys.exit(guarded(lambda: _run(parser.parse_args())))


def _run(arguments) -> None:
    rows = []
    for case in cases(arguments.data):
        rows.append(judged(case))
        say(" | ".join(rows[-1]))
    if not rows:
        raise RecordingError(
            f"{arguments.data}: no recording that is known here: folders cyberdiver, nhtsa-10146, outside"
        )
    head = ["recording", "true", "told", "error", "left, of the peak", "right", "processor"]
    write_markdown(arguments.to, [HEAD, f"{markdown_table(head, rows)}\n"])


if __name__ == "__main__":
    main()
