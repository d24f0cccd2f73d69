"""How a command ends: one line on standard error and its exit status, whatever is raised."""

import errno
import os
import signal
import subprocess
import sys
import time
from contextlib import nullcontext
from threading import Thread

import pytest
from helpers_paths import BAGS

from crash_estimator.cli import diagnose, estimate, report, simulate
from crash_estimator.demo import command as demo
from crash_replay import import_command, replay_node, ros_runtime, synthesize_command
from crash_replay.fault import Fault, NobodyReads, guarded
from crash_replay.output import written


def raising(error):
    def command():
        raise error

    return command


def endless():
    return endless()


@pytest.mark.parametrize(
    "command, said",
    [
        (raising(Fault("a.csv:7: expected\na number")), "error: a.csv:7: expected a number"),
        (raising(Fault("a\x1b[31m.csv")), r"error: a\x1b[31m.csv"),
        (raising(FileNotFoundError(errno.ENOENT, "No such file or directory", "a.csv")),
         "error: a.csv: No such file or directory"),
        (raising(OSError("no free port")), "error: no free port"),
        (raising(OSError(errno.EBADF, "Bad file")), "error: a fault of the program: OSError: [Errno 9] Bad file"),
        (raising(ZeroDivisionError("division\nby")), "error: a fault of the program: ZeroDivisionError: division by"),
        (raising(MemoryError()), "error: a fault of the program: MemoryError (at replay/test_fault.py:"),
        (raising(SystemExit(0)), "error: a fault of the program: SystemExit: 0"),
        (raising(BrokenPipeError(errno.EPIPE, "Broken pipe")), "error: a fault of the program: BrokenPipeError"),
        (endless, "error: a fault of the program: RecursionError: maximum recursion depth exceeded"),
        (raising(ValueError("x" * 100_000)), "error: a fault of the program: ValueError: xxx"),
    ],
)  # fmt: skip
def test_whatever_is_raised_is_one_line_and_status_1(command, said, capsys):
    assert guarded(command) == 1
    told = capsys.readouterr()
    assert told.out == "" and told.err.startswith(said) and told.err.count("\n") == 1 and len(told.err) < 1200
    if "a fault of the program" in said:
        assert "CRASH_TRACEBACK=1 shows the traceback" in told.err


def test_a_fault_is_one_line_wherever_it_is_said():
    assert "{}".format(Fault("a:\n  b\x1b[0m")) == r"a: b\x1b[0m" and str(Fault("a  b")) == "a  b"


def test_the_traceback_is_shown_where_it_is_asked_for(capsys, monkeypatch):
    monkeypatch.setenv("CRASH_TRACEBACK", "1")
    assert guarded(raising(ZeroDivisionError("oh"))) == 1
    told = capsys.readouterr().err.splitlines()
    assert told[0].startswith("Traceback") and told[-1].startswith(
        "error: a fault of the program: ZeroDivisionError: oh"
    )


def test_other_ends(capsys):
    assert [guarded(lambda: None), guarded(lambda: 3)] == [0, 3]
    assert guarded(raising(KeyboardInterrupt())) == 130
    assert guarded(raising(NobodyReads())) == 141
    assert guarded(raising(LookupError("its own")), also=(LookupError,)) == 1
    assert capsys.readouterr().err == "error: its own\n"


def test_what_ends_a_thread_is_a_line_and_status_1(capsys):
    def command():
        thread = Thread(target=raising(ZeroDivisionError("in a thread")))
        thread.start()
        thread.join()

    assert guarded(command) == 1
    told = capsys.readouterr().err
    assert told.startswith("error: a fault of the program: ZeroDivisionError: in a thread") and told.count("\n") == 1


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_leaves_nothing_half_written(number, tmp_path, capsys):
    def command():
        with written(tmp_path / "a.txt") as file:
            file.write_text("half of")
            os.kill(os.getpid(), number)
            time.sleep(5.0)

    assert guarded(command) == 128 + number
    assert list(tmp_path.iterdir()) == [] and signal.getsignal(number) is signal.SIG_DFL
    assert capsys.readouterr().err == ""


def test_a_signal_whose_exception_is_lost_comes_again(capsys):
    """Python cannot let it rise from here, as from a callback of numba's while that compiles."""

    class Lost:
        def __del__(self):
            signal.raise_signal(signal.SIGTERM)
            time.sleep(0.0)

    def command():
        Lost()
        time.sleep(5.0)

    assert guarded(command) == 128 + signal.SIGTERM
    assert capsys.readouterr().err == ""


def test_a_signal_that_a_compiled_module_words_otherwise_still_ends_it(capsys):
    """As numpy's and pybind11's do while they are being imported."""

    def command():
        try:
            signal.raise_signal(signal.SIGTERM)
        except BaseException as error:
            raise ImportError("initialization failed") from error

    assert guarded(command) == 128 + signal.SIGTERM
    assert capsys.readouterr().err == ""


OF_A_BAG = ["impactor_single.mcap", "--model", "impactor_single"]
COMMANDS = [
    (estimate, "crash_estimator.cli.work.estimate.load_model", OF_A_BAG),
    (simulate, "crash_estimator.cli.work.simulate.load_model", OF_A_BAG),
    (diagnose, "crash_estimator.cli.work.diagnose.load_model", OF_A_BAG),
    (report, "crash_estimator.cli.work.report.load_model", [*OF_A_BAG, "--to", "out"]),
    (import_command, "crash_replay.import_work.read_source", ["a.csv", "--to", "b.mcap"]),
    (synthesize_command, "crash_replay.synthesize_command.write_bag", ["impactor_single", "--to", "b.mcap"]),
    (demo, "crash_estimator.demo.start.claim", ["--recording", "a.mcap"]),
]


@pytest.mark.parametrize("command, step, arguments", COMMANDS, ids=lambda value: getattr(value, "__name__", None))
def test_every_command_ends_with_a_line(command, step, arguments, monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(step, lambda *_, **__: raising(RuntimeError("broken"))())
    if command is demo:
        monkeypatch.setattr(demo, "interrupted_by_signals", nullcontext)
    monkeypatch.setattr(sys, "argv", ["command", *arguments])
    try:
        status = command.main()
    except SystemExit as ended:
        status = ended.code
    said = capsys.readouterr().err
    assert status == 1 and said.startswith("error: a fault of the program: RuntimeError: broken (at "), said
    assert said.count("\n") == 1 and list(tmp_path.iterdir()) == []


def test_every_node_ends_with_a_line(monkeypatch, capsys):
    for module, main in ((ros_runtime, lambda: ros_runtime.run(raising(RuntimeError("broken")), ())),
                         (replay_node, replay_node.main)):  # fmt: skip
        monkeypatch.setattr(module, "prepare_middleware", raising(RuntimeError("broken")))
        assert main() == 1
        assert capsys.readouterr().err.startswith("error: a fault of the program: RuntimeError: broken (at ")


LATE = """
import sys
from crash_estimator.core.effects.base import ElementForce

calls = []

def force(motion):
    calls.append(1)
    if len(calls) > 1:
        {raised}
    return motion.rate

EFFECT = ElementForce("late", "N*s/m", force=force)
"""


@pytest.mark.parametrize("effects", ["import sys; sys.exit(0)", LATE.format(raised="sys.exit(0)"),
                                     LATE.format(raised="raise RuntimeError('late')")])  # fmt: skip
def test_a_user_s_effect_cannot_end_a_command_well(effects, tmp_path):
    (tmp_path / "own.py").write_text(effects)
    arguments = [BAGS / "impactor_single.mcap", "--model", "impactor_single", "--effects", tmp_path / "own.py"]
    command = [sys.executable, "-m", "crash_estimator.cli.diagnose", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ)
    assert done.returncode == 1 and done.stdout == ""
    assert done.stderr.startswith("error: ") and done.stderr.count("\n") == 1 and "own.py" in done.stderr, done.stderr
