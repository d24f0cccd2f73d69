"""After the set-up nothing is left to compile: whatever the method, the model, or what is asked of the diagnosis."""

import ast
import subprocess
import sys
from pathlib import Path

from crash_estimator.core import compile_cache

USE = """
import sys
from itertools import islice
from crash_estimator.core.compile_cache import compiling_said
from crash_estimator.core.diagnosis.report.diagnosis import diagnose
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.methods import METHODS, make_estimator
from crash_estimator.model_file import load_model
from crash_estimator.nodes.diagnosis_answerer import Answerer
from crash_replay.synthetic.recordings import simulate_recording

with compiling_said(print):
    for name, model in {"frontal_engine_cab": "frontal_engine_cab", "side_dummy_padded": "side_dummy"}.items():
        recording, _ = simulate_recording(name)
        structure = load_model(model)
        for method in METHODS:
            if method == "effective_mass" and not any(c.quantity == "force" for c in recording.test.channels):
                continue
            estimator = make_estimator(structure, recording.test, method)
            state = estimator.init()
            for sample in islice(recording.samples(), 3):
                state, _ = estimator.step(state, sample)
        Answerer(EFFECTS).try_out(structure)
    diagnose(structure, [recording], EFFECTS)
print("used")
"""


def test_what_is_warmed_up_is_all_that_is_compiled():
    done = subprocess.run([sys.executable, "-m", "crash_estimator.warm_up"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    said = done.stdout.splitlines()
    assert [line[:16] for line in said] == ["compiled 1 of 2:", "compiled 2 of 2:"]
    assert sorted(line[16:].split(",")[0].strip() for line in said) == ["diagnosis", "estimators"]
    used = subprocess.run([sys.executable, "-c", USE], capture_output=True, text=True, check=True)
    assert used.stdout == "used\n"


def test_what_must_be_compiled_is_said_once():
    code = (
        "from numba import njit\n"
        "from crash_estimator.core.compile_cache import compiling_said\n"
        "with compiling_said(print):\n"
        "    for k in range(2):\n"
        "        njit(lambda x: x + k)(1.0)\n"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert said.count("\n") == 1 and said.startswith("compiling ")


def test_compiled_code_is_renewed_after_a_change_of_whatever_it_takes_from_another_file():
    core = Path(compile_cache.__file__).parent
    files = compile_cache.sources(core)
    assert set(core.glob("*.py")) | set(core.glob("compiled/*.py")) | set(core.glob("estimators/*.py")) <= set(files)
    for file in core.rglob("*.py"):
        if "@njit" in (text := file.read_text()):
            assert taken_by(file, text) <= set(files), f"{file}: constants or compiled functions of other files"


def taken_by(file: Path, text: str) -> set[Path]:
    """Files that what is compiled in this one takes names from."""
    defined = [node for node in ast.parse(text).body if isinstance(node, ast.FunctionDef)]
    functions = [node for node in defined if "njit" in "".join(map(ast.unparse, node.decorator_list))]
    used = {node.id for function in functions for node in ast.walk(function) if isinstance(node, ast.Name)}
    imports = [node for node in ast.parse(text).body if isinstance(node, ast.ImportFrom) and node.level]
    return {
        file.parents[node.level - 1].joinpath(*node.module.split(".")).with_suffix(".py")
        for node in imports
        if node.module and used & {name.asname or name.name for name in node.names}
    }
