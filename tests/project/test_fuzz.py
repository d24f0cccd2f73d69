"""A few hundred spoilt inputs on every way in; `make fuzz` tries 20 000."""

import json
from pathlib import Path
from random import Random

import pytest
from rclpy.serialization import deserialize_message

from crash_estimator.fuzz import command, mutations, worker
from crash_estimator.fuzz.targets import REQUEST, TARGETS, Target
from crash_estimator.fuzz.worker import Slow, input_of, tried
from crash_replay.cdr import PLAIN

EACH = 25
NODES = ("estimator node", "diagnosis node")


@pytest.mark.parametrize("target", [name for name in TARGETS if name not in NODES])
def test_spoilt_input_is_taken_or_refused_with_one_line(target, monkeypatch):
    monkeypatch.setattr(worker, "MOST", float("inf"))  # other tests have been in this process
    for number in range(EACH):
        seed = f"test.{number}"
        result = tried(target, seed, input_of(target, seed))
        assert result.outcome in ("taken", "refused"), f"{seed}: {result.outcome}\n{result.detail}"


@pytest.mark.parametrize("target", TARGETS)
def test_a_seed_makes_the_same_input_again(target):
    assert input_of(target, "a") == input_of(target, "a")
    assert any(input_of(target, "a") != input_of(target, seed) for seed in "bcd")


def test_what_the_memory_held_between_the_fields_of_a_message_is_no_part_of_it():
    clean = mutations.serialized(REQUEST)
    dirty, gap = bytearray(clean), clean.index(b"coulomb_friction\0") + len(b"coulomb_friction\0")
    dirty[gap] = 0xBE
    assert deserialize_message(bytes(dirty), type(REQUEST)) == REQUEST == deserialize_message(clean, type(REQUEST))
    assert mutations._zero_gaps(REQUEST, dirty, len(PLAIN)) == len(clean) and dirty == clean


def endless(_: Path) -> None:
    while True:
        pass


def fault(_: Path) -> None:
    raise KeyError("not ours")


def two_lines(_: Path) -> None:
    raise OSError("one\ntwo")


@pytest.mark.parametrize(
    ("take", "outcome"),
    [
        (endless, "longer than 0.2 s"),
        (fault, "KeyError"),
        (two_lines, "not one printable line"),
        (lambda _: None, "taken"),
    ],
)
def test_what_a_failure_is(monkeypatch, take, outcome):
    monkeypatch.setattr(worker, "LONGEST", 0.2)
    monkeypatch.setattr(worker, "MOST", float("inf"))
    monkeypatch.setitem(TARGETS, "it", Target(1, lambda rng: {"a": rng.randbytes(3)}, take))
    result = tried("it", "1", input_of("it", "1"))
    assert result.outcome == outcome and result.failed == (outcome != "taken")
    assert not issubclass(Slow, Exception), "no guard against any exception may swallow it"


def test_a_failure_is_kept_and_replayed(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(worker, "MOST", float("inf"))
    monkeypatch.setattr(command, "restrict", lambda: None)
    monkeypatch.setitem(TARGETS, "it", Target(1, lambda rng: {"a": rng.randbytes(3)}, fault))
    file = command.save(tried("it", "1", input_of("it", "1")), tmp_path)
    assert json.loads(file.read_text())["files"] == {"a": Random("1").randbytes(3).hex()}
    assert command.replay(file) == 1
    assert "KeyError" in capsys.readouterr().out


def test_all_ways_in_are_drawn_and_seeds_differ():
    drawn = list(command.plan(500, 1, list(TARGETS)))
    assert {target for target, _ in drawn} == set(TARGETS) and len(set(drawn)) == 500
