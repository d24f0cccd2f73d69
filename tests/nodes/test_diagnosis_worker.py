"""The diagnosis in a process of its own: it answers, is replaced where it ends, and lives on where an effect fails."""

import struct
import subprocess
import sys
import time
from dataclasses import replace
from multiprocessing.connection import Connection, Pipe

import pytest
from helpers_diagnosis import hidden_case, so_far

from crash_estimator.core.structure import EffectSpec
from crash_estimator.nodes.diagnosis_worker import DEATHS, Task, Worker, WorkerError


@pytest.fixture(scope="module")
def damped():
    """A damper that the model of one mass has not got."""
    return hidden_case("single", "viscous_damping", 8101)


OWN_EFFECT = """
import numpy as np
from crash_estimator.core.effects.base import ElementForce

EFFECT = ElementForce("stick", "N", force=lambda motion: np.tanh(motion.rate / 0.05), size=1000.0)
print("a line that must not get between the answers")
"""


def test_a_process_answers_with_the_users_effects_and_is_replaced_where_it_ends(damped, tmp_path):
    _, model, recording = damped
    path = tmp_path / "stick.py"
    path.write_text(OWN_EFFECT)
    worker = Worker(model, str(path))
    try:
        assert _reply(worker, ready=True) is None
        worker.ask(Task(model, recording, final=True))
        names = {ranked.effect for ranked in _reply(worker).answer.ranking}
        assert {"stick", "viscous_damping"} <= names
        worker.ask(Task(model, so_far(recording, 0.03), final=False))
        worker.process.kill()
        assert _reply(worker).answer is not None, "a new one is asked the same"
        wrong = replace(model, effects=(EffectSpec("viscous_damping", "nowhere"),))
        worker.ask(Task(wrong, so_far(recording, 0.03), final=False))
        assert "'nowhere'" in _reply(worker).error
        worker.ask(Task(model, recording, final=True))
        worker.drop()
        assert _reply(worker, ready=True) is None, "nobody waits for that answer: it never comes"
    finally:
        worker.close()


def test_a_process_that_is_killed_while_it_has_nothing_to_do_is_replaced(damped):
    _, model, recording = damped
    worker = Worker(model)
    try:
        assert _reply(worker, ready=True) is None
        worker.process.kill()
        worker.process.wait()
        worker.ask(Task(model, so_far(recording, 0.03), final=False))
        assert _reply(worker).answer is not None
    finally:
        worker.close()


def test_a_process_that_ends_again_and_again_is_given_up(damped):
    worker = Worker(damped[1])
    try:
        with pytest.raises(WorkerError, match=f"ended {DEATHS + 1} times, at last with status -9"):
            while True:
                worker.process.kill()
                worker.process.wait()
                worker.reply()
    finally:
        worker.close()


def test_a_fault_in_a_users_effect_is_told_by_its_name_and_the_process_lives(damped, tmp_path):
    _, model, recording = damped
    path = tmp_path / "stick.py"
    path.write_text(OWN_EFFECT.replace("np.tanh(", "1 / 0 if len(motion.time) > 64 else np.tanh("))
    worker = Worker(model, str(path))
    try:
        assert _reply(worker, ready=True) is None
        worker.ask(Task(model, recording, final=True))
        failed = f"{path}: force of 'stick' fails on a motion it was tried on: ZeroDivisionError: division by zero"
        assert _reply(worker).error == failed
        assert worker.process.poll() is None
    finally:
        worker.close()


def _reply(worker: Worker, ready: bool = False):
    """What it replies; ready: no reply is awaited, only that it can be asked."""
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline:
        reply = worker.reply()
        if reply is not None or (ready and not worker.busy):
            return reply
        time.sleep(0.01)
    raise AssertionError("waited 60 s in vain for the process")


def nothing(node: Connection, setup) -> None:
    pass


def half_a_message(node: Connection, setup) -> None:
    with open(node.fileno(), "wb", closefd=False) as pipe:
        pipe.write(struct.pack("!i", 1000) + b"its beginning")


def the_first(node: Connection, setup) -> None:
    node.send(setup)


@pytest.mark.parametrize("says", [nothing, half_a_message, the_first])
def test_a_node_that_is_killed_leaves_no_traceback(says, damped):
    node, its = Pipe()
    command = f"from crash_estimator.nodes.diagnosis_answerer import main; main({its.fileno()})"
    process = subprocess.Popen([sys.executable, "-c", command], pass_fds=[its.fileno()], stderr=subprocess.PIPE)
    its.close()
    says(node, (damped[1], "", ()))
    node.close()
    assert process.communicate(timeout=60.0) == (None, b"") and process.returncode == 0
