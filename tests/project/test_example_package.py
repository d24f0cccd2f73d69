"""The example package: what it imports, its mechanics, and that it predicts a crash from the README's commands."""

import ast
import math
import re
import shlex
import subprocess
import sys
import textwrap

import pytest
import rclpy
from crash_msgs.msg import Parameter, Parameters
from helpers_domain import own_domain
from helpers_paths import ROOT
from helpers_readme import EXAMPLE, README, environment
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from crash_examples.air_bag_trigger import AirBagTrigger
from crash_examples.mass_spring_damper import MassSpringDamper
from crash_examples.predictions import Prediction, told
from crash_replay.synthetic.recordings import simulate_recording

PACKAGE = ROOT / "ros2_ws" / "src" / "crash_examples"
SWINGS, CREEPS = MassSpringDamper(1719.0, 6.0e5, 2000.0), MassSpringDamper(10.0, 1.0e3, 400.0)
CRITICAL, NO_SPRING = MassSpringDamper(10.0, 1.0e3, 200.0), MassSpringDamper(10.0, 0.0, 50.0)


def test_of_ours_it_knows_the_messages_only():
    imported = set()
    for file in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.Import):
                imported |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                imported.add(node.module.partition(".")[0])
    foreign = imported - set(sys.stdlib_module_names) - {"crash_examples", "setuptools"}
    assert foreign == {"crash_msgs", "rclpy", "std_msgs"}
    asked = set(re.findall(r"<exec_depend>(.+?)</exec_depend>", (PACKAGE / "package.xml").read_text()))
    assert asked == foreign


@pytest.mark.parametrize("car", [SWINGS, CREEPS, CRITICAL, NO_SPRING])
def test_its_motion_is_that_of_the_equation(car):
    def rates(_, state):
        return state[1], -(car.stiffness * state[0] + car.damping * state[1]) / car.mass

    solved = solve_ivp(rates, (0.0, 0.1), (0.02, 9.0), rtol=1e-10, atol=1e-12)
    assert_allclose(car.after(0.02, 9.0, 0.1), solved.y[:, -1], rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("car", [SWINGS, CRITICAL, CREEPS])
def test_it_stands_still_when_it_says(car):
    left = car.still_to_go(0.02, 9.0)
    assert 0.0 < left < math.inf
    assert_allclose(car.after(0.02, 9.0, left)[1], 0.0, atol=1e-9)
    assert car.after(0.02, 9.0, 0.9 * left)[1] > 0.0


def test_without_a_spring_it_never_stands_still():
    assert NO_SPRING.still_to_go(0.02, 9.0) == math.inf


def test_a_row_for_every_5_ms():
    steps = [Prediction(k * 1e-4, 0.5, 0.08) for k in range(1, 700)]
    rows = told(steps, 0.5, 0.08, None).splitlines()[1:]
    assert [float(row.split()[0]) for row in rows[1:-1]] == [5.0 * k for k in range(1, 14)]
    assert rows[-1] == "not fired"


def test_an_element_that_there_is_not_is_said():
    rclpy.init(domain_id=own_domain(), args=["--ros-args", "-p", "element:=spring"])
    node = AirBagTrigger()
    try:
        with pytest.raises(SystemExit, match="no spring.stiffness among car_barrier.stiffness: -p element:=NAME"):
            node.on_parameters(Parameters(time=0.01, parameters=[Parameter(name="car_barrier.stiffness")]))
    finally:
        node.destroy_node()
        rclpy.shutdown()


def test_the_code_that_is_shown_is_the_node_s():
    (shown,) = [code for code in re.findall(r"```python\n(.*?)```", README, re.S) if "on_parameters" in code]
    assert textwrap.indent(shown, "    ") in (PACKAGE / "crash_examples" / "air_bag_trigger.py").read_text()
    assert shown.count("\n") <= 22


def test_it_predicts_a_crash_while_it_runs(tmp_path):
    """The README's three commands; against what the simulator integrated, which shares no code with the estimator."""
    crush = simulate_recording("frontal_single")[1].elements["car_barrier"].crush
    times = simulate_recording("frontal_single")[1].time_ns
    stated = {key: float(value) for key, value in re.findall(r"measured_(\w+):=(\S+)", " ".join(EXAMPLE))}
    assert stated == pytest.approx({"crush": crush.max(), "time": times[crush.argmax()] * 1e-9}, abs=1e-4)

    together = environment()
    estimator, example, replay = (shlex.split(command) for command in EXAMPLE)
    with open(tmp_path / "estimator.log", "w+") as log:
        following = subprocess.Popen(estimator, cwd=ROOT, env=together, stdout=log, stderr=log)
        trigger = subprocess.Popen(
            example, cwd=ROOT, env=together, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE
        )
        try:
            waiting = ["-p", "wait_timeout:=120.0", "-p", "delay:=5.0"]  # by when the example is there as well
            subprocess.run([*replay, *waiting], cwd=ROOT, env=together, check=True, capture_output=True, timeout=200)
            said, errors = trigger.communicate(timeout=60)
        finally:
            for process in (trigger, following):
                process.terminate()
                process.wait(30)
    assert trigger.returncode == 0, errors
    *rows, fired = said.splitlines()[1:]
    at, _, wrong_mm, _, wrong_ms = zip(*([float(value) for value in row.split()] for row in rows))
    settled = [k for k, time in enumerate(at) if time >= 40.0]
    assert len(settled) >= 8 and at[0] < 5.0
    assert max(abs(wrong_mm[k]) for k in settled) < 10.0 and max(abs(wrong_ms[k]) for k in settled) < 2.0
    assert abs(wrong_mm[0]) > 50.0, "a structure that softens as it crushes cannot be foreseen at once"
    assert float(re.match(r"fired at ([\d.]+) ms", fired)[1]) < 10.0
    shown = re.search(r"( +at ms .*?\nfired .*?)\n", README, re.S)[1].splitlines()
    assert [row for row in shown if row not in said.splitlines()] == []
