"""Two sleds side by side on one graph, each with its nodes in a namespace: none has anything of the other."""

import subprocess
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from helpers_bag import assert_same
from helpers_domain import own_domain
from helpers_nodes import end, environment, executable
from helpers_paths import BAGS
from helpers_viewer import rows
from mcap.reader import make_reader
from numpy.testing import assert_array_equal

from crash_replay.bag import read_bag
from crash_replay.message_types import typestore
from crash_replay.same_messages import messages_by_topic

PACKAGE = {"replay": "crash_replay", "record": "crash_replay"}
FIELDS = {  # of what an estimator says of every sample
    "ParametersBlock": ("value", "std", "status"),
    "ResidualsBlock": ("measured", "predicted", "innovation", "innovation_std", "residual", "residual_std"),
    "Forces": ("crush", "rate", "force", "force_std", "state", "displacement", "velocity", "acceleration"),
}
LONG = 300.0
"""s for ten nodes on two cores that others use as well."""


class Sled(NamedTuple):
    namespace: str  # "" for none
    bag: Path  # of 10 kHz
    model: str
    estimator: str  # its name
    lockstep: bool

    def start(self, folder: Path, domain: int, *besides: str) -> dict[str, subprocess.Popen]:
        """Replay, estimator and record, and what is asked for besides."""
        names = ["replay", self.estimator, "record", *besides]
        given = {
            "replay": {
                "bag": self.bag, "lockstep": self.lockstep, "listeners": names[1:], "wait_timeout": LONG,
                "answer_timeout": LONG,
            },
            self.estimator: {"model": self.model, "method": self.estimator},
            "record": {"to": folder / "said.mcap"},
            "viewer": {"rrd": folder / "shown.rrd", "port": 0, "open": False, "exit_when_finished": True},
            "diagnosis": {"model": self.model, "time_limit": 1.0},  # that it answers counts here, not what
        }  # fmt: skip
        folder.mkdir(parents=True)
        return {name: self._start(name, given[name], domain) for name in names}

    def _start(self, name: str, given: Mapping, domain: int) -> subprocess.Popen:
        kind = "estimator" if name == self.estimator else name
        words = ["--ros-args", "-r", f"__node:={name}", "-r", f"__ns:={self.namespace or '/'}"]
        for key, value in given.items():
            words += ["-p", f"{key}:={str(value).lower() if isinstance(value, bool) else value}"]
        command = executable(PACKAGE.get(kind, "crash_estimator"), kind) + words
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        return subprocess.Popen(command, env=environment(ROS_DOMAIN_ID=str(domain)), **pipes)


A = Sled("/sled_a", BAGS / "side_dummy_padded.mcap", "side_dummy", "constrained_kalman", True)
B = Sled("/sled_b", BAGS / "frontal_engine_cab.mcap", "frontal_engine_cab", "mrls", False)


def replayed(sleds: Mapping[Path, Sled], *besides: str) -> dict[str, str]:
    """All of them at once, until replay, record and viewer have ended by themselves -> what each node said."""
    said, domain = {}, own_domain()
    started = {sled: sled.start(folder, domain, *besides) for folder, sled in sleds.items()}
    with ExitStack() as at_the_end:
        at_the_end.callback(end, [process for nodes in started.values() for process in nodes.values()])
        for sled, nodes in started.items():
            for name in ("replay", "record", *(one for one in besides if one == "viewer")):
                text, _ = nodes[name].communicate(timeout=LONG)
                said[f"{sled.namespace}/{name}"] = text
                assert nodes[name].returncode == 0, f"{sled.namespace}/{name}: {text}"
    return said


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("namespaces")


@pytest.fixture(scope="module")
def side_by_side(folder) -> dict[str, str]:
    """Both sleds with all nodes there are, at 10 kHz in real time, in lock-step on one of them."""
    return replayed({folder / "both" / "sled_a": A, folder / "both" / "sled_b": B}, "viewer", "diagnosis")


@pytest.fixture(scope="module")
def alone(folder) -> None:
    """Each by itself, without a namespace."""
    for sled in (A, B):
        replayed({folder / "alone" / sled.namespace[1:]: sled._replace(namespace="")})


def topics(file: Path) -> set[str]:
    with file.open("rb") as stream:
        return {channel.topic for channel in make_reader(stream).get_summary().channels.values()}


def of_estimator(file: Path, sled: Sled) -> dict[str, list[tuple[int, bytes]]]:
    start = f"{sled.namespace}/{sled.estimator}/"
    found = messages_by_topic(file)
    return {name.removeprefix(start): said for name, said in found.items() if name.startswith(start)}


def numbers(said: Mapping[str, list[tuple[int, bytes]]]) -> dict[str, np.ndarray]:
    """Each field of all messages, sample by sample, in however many messages they came."""
    found = {}
    for topic, kind in (
        ("block/parameters", "ParametersBlock"),
        ("block/residuals", "ResidualsBlock"),
        ("forces", "Forces"),
    ):
        messages = [typestore().deserialize_cdr(data, f"crash_msgs/msg/{kind}") for _, data in said[topic]]
        for field in ("time_ns", *FIELDS[kind]):
            found[f"{topic}.{field}"] = np.concatenate([getattr(message, field) for message in messages])
    return found


@pytest.mark.usefixtures("side_by_side")
@pytest.mark.parametrize("sled", [A, B], ids=lambda sled: sled.namespace[1:])
def test_a_sled_records_and_shows_its_own(folder, sled):
    here = folder / "both" / sled.namespace[1:]
    others = {A: B, B: A}[sled]
    recorded = topics(here / "said.mcap") - {"/diagnostics"}
    assert {f"{sled.namespace}/{name}" for name in ("test", "samples", "diagnosis/ranking")} <= recorded
    assert all(topic.startswith(f"{sled.namespace}/") for topic in recorded)
    assert_same(read_bag(here / "said.mcap"), read_bag(sled.bag))
    shown = set(rows(here / "shown.rrd"))
    assert any(f"/{sled.estimator}/" in entity for entity in shown)
    assert not any(f"/{others.estimator}/" in entity for entity in shown)
    with (here / "said.mcap").open("rb") as stream:
        statuses = [
            status.name
            for schema, _, message in make_reader(stream).iter_messages(topics=["/diagnostics"])
            for status in typestore().deserialize_cdr(message.data, schema.name).status
        ]
    assert statuses and all(name.startswith(f"{sled.namespace[1:]}/") for name in statuses)


@pytest.mark.usefixtures("alone")
def test_in_lock_step_it_says_the_same_bytes_as_alone(folder, side_by_side):
    both, single = (folder / one / "sled_a" / "said.mcap" for one in ("both", "alone"))
    assert of_estimator(both, A) == of_estimator(single, A._replace(namespace=""))
    assert len(numbers(of_estimator(both, A))["forces.time_ns"]) == len(read_bag(A.bag))


@pytest.mark.usefixtures("alone")
def test_beside_it_the_other_finds_the_same_numbers_as_alone(folder, side_by_side):
    both, single = (folder / one / "sled_b" / "said.mcap" for one in ("both", "alone"))
    found, expected = numbers(of_estimator(both, B)), numbers(of_estimator(single, B._replace(namespace="")))
    assert found.keys() == expected.keys() and len(found["forces.time_ns"]) == len(read_bag(B.bag))
    for field, values in found.items():
        assert_array_equal(values, expected[field], err_msg=field)
