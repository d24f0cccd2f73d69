"""A believable stream of estimates for the viewer's tests: a cab and an engine against a barrier, K known.

Cab 1300 kg, engine 400 kg, 16 m/s. Springs cab-barrier, engine-barrier and cab-engine carry compression and a little
tension; integrated here with the explicit midpoint rule. An "estimator" is the truth with an error that dies away.
"""

import os
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from helpers_waiting import PATIENCE
from rerun.chunk import RrdReader

from crash_estimator.core.estimate import ParameterStatus
from crash_estimator.viewer.blocks import Block, EventBlock, ForceBlock, ParameterBlock, ResidualBlock, TestBlock
from crash_estimator.viewer.recorder import Recorder
from crash_estimator.viewer.sinks import Sinks

NAMES = ("mrls", "ckf")
MASSES = np.array([1300.0, 400.0])
STIFFNESS = np.array([4.0e5, 9.0e5, 6.0e5])  # cab_barrier, engine_barrier, cab_engine, N/m
ELEMENTS = ("cab_barrier", "engine_barrier", "cab_engine")
BETWEEN = ("cab-barrier", "engine-barrier", "cab-engine")
NOISE = np.array([10.0, 10.0, 5e3])  # cab m/s^2, engine m/s^2, barrier N


class Crash(NamedTuple):
    time_ns: np.ndarray  # (n,)
    crush: np.ndarray  # (n, 3)
    force: np.ndarray  # (n, 3)
    velocity: np.ndarray  # (n, 3) cab, engine, barrier
    rate: np.ndarray  # (n, 3)
    displacement: np.ndarray  # (n, 3)
    truth: np.ndarray  # (n, 3) cab and engine acceleration, barrier force
    measured: np.ndarray  # (n, 3) with noise


def test_block(crash: Crash) -> TestBlock:
    return TestBlock("two-mass", "cab and engine against a barrier", "tests", len(crash.time_ns), 1e-4)


test_block.__test__ = False


def simulate(n: int = 1500, pre: int = 100, seed: int = 0) -> Crash:
    """n samples at 10 kHz, of which `pre` lie before the impact."""
    time_ns = np.arange(-pre, n - pre, dtype=np.int64) * 100_000
    state = np.array([0.0, 0.0, 16.0, 16.0])  # positions, velocities
    rows = []
    for t in time_ns:
        rows.append(_forces(state) if t >= 0 else (np.zeros(3), np.zeros(3), state * [0, 0, 1, 1]))
        if t >= 0:
            middle = state + 0.5e-4 * _derivative(state)
            state = state + 1e-4 * _derivative(middle)
    crush, force, states = (np.array(column) for column in zip(*rows))
    truth = np.column_stack([_accelerations(force), force[:, 0] + force[:, 1]])
    measured = truth + NOISE * np.random.default_rng(seed).standard_normal(truth.shape)
    displacement, velocity = (np.column_stack([half, np.zeros(n)]) for half in (states[:, :2], states[:, 2:]))
    rate = np.column_stack([velocity[:, 0], velocity[:, 1], velocity[:, 0] - velocity[:, 1]])
    return Crash(time_ns, crush, force, velocity, rate, displacement, truth, measured)


def _forces(state: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    crush = np.array([state[0], state[1], state[0] - state[1]])
    force = STIFFNESS * np.maximum(crush, 0.0)
    return crush, force, state


def _accelerations(force: np.ndarray) -> np.ndarray:
    return np.stack([-force[..., 0] - force[..., 2], -force[..., 1] + force[..., 2]], axis=-1) / MASSES


def _derivative(state: np.ndarray) -> np.ndarray:
    return np.concatenate([state[2:], _accelerations(_forces(state)[1])])


def estimates(
    crash: Crash, estimator: str, error: float = 0.3, run: int = 0, size: int = 50, seed: int = 1
) -> list[Block]:
    """Blocks of `size` samples of an estimator whose parameters start `error` off and settle within 40 ms."""
    random = np.random.default_rng(seed)
    n = len(crash.time_ns)
    seconds = np.maximum(crash.time_ns * 1e-9, 0.0)[:, None]
    std = STIFFNESS * (0.005 + np.exp(-seconds / 0.01))
    value = STIFFNESS * (1 + error * np.exp(-seconds / 0.01)) * (1 + 0.005 * random.standard_normal((n, 3)))
    predicted = crash.truth * (1 - 0.5 * error * np.exp(-seconds / 0.02))
    residual = crash.measured - predicted
    sigma = np.tile(NOISE, (n, 1))
    state = np.where(crash.crush <= 0, 2, np.where(np.gradient(crash.crush, axis=0) > 0, 0, 1)).astype(np.uint8)
    acceleration = np.column_stack([crash.measured[:, :2], np.full(n, np.nan)])
    blocks: list[Block] = []
    for start in range(0, n, size):
        rows = slice(start, start + size)
        head = (estimator, run, start, crash.time_ns[rows], "frontal_engine_cab", estimator)
        names = tuple(f"{element}.stiffness" for element in ELEMENTS)
        blocks.append(
            ParameterBlock(*head, names, ("N/m",) * 3, value[rows], std[rows], np.zeros((len(head[3]), 3), np.uint8))
        )
        blocks.append(
            ResidualBlock(
                *head,
                ("cab", "engine", "barrier"),
                ("m/s^2", "m/s^2", "N"),
                crash.measured[rows],
                predicted[rows],
                1.2 * residual[rows],
                1.2 * sigma[rows],
                residual[rows],
                sigma[rows],
            )
        )
        blocks.append(
            ForceBlock(
                *head,
                ELEMENTS,
                BETWEEN,
                ("cab", "engine", "barrier"),
                np.array([*MASSES, np.nan]),
                crash.crush[rows],
                (value * np.maximum(crash.crush, 0.0))[rows],
                state[rows],
                crash.velocity[rows],
                acceleration[rows],
                crash.rate[rows],
                crash.displacement[rows],
            )
        )
    return blocks


def events(crash: Crash, estimator: str, run: int = 0) -> list[EventBlock]:
    """The contact and the turn of each element."""
    found = []
    for k, element in enumerate(ELEMENTS):
        contact, turn = int(np.argmax(crash.crush[:, k] > 0)), int(np.argmax(crash.crush[:, k]))
        for number, kind in ((contact, "loading"), (turn, "unloading")):
            time, crush_mm = crash.time_ns[number] * 1e-9, 1e3 * crash.crush[number, k]
            found.append(
                EventBlock(
                    estimator, run, number, time, kind, element, f"{element}: {kind} at {crush_mm:.0f} mm of crush"
                )
            )
    return found


def two_streams(crash: Crash, size: int = 50) -> dict[str, list[Block]]:
    """Blocks of two estimators, one starting 30 % too stiff, one 20 % too soft."""
    settings = zip(NAMES, (0.3, -0.2), (1, 2))
    return {name: estimates(crash, name, error, size=size, seed=seed) for name, error, seed in settings}


def with_damping(block: ParameterBlock) -> ParameterBlock:
    """None, which is known."""
    none = np.zeros((len(block.time_ns), len(ELEMENTS)))
    return block._replace(
        name=(*block.name, *(f"{element}.damping" for element in ELEMENTS)),
        unit=(*block.unit, *["N*s/m"] * len(ELEMENTS)),
        value=np.hstack([block.value, none]),
        std=np.hstack([block.std, none]),
        status=np.hstack([block.status, np.full(none.shape, ParameterStatus.KNOWN, np.uint8)]),
    )


def recorder(rrd: Path | str, **settings) -> Recorder:
    """A recorder that expects both estimators, its server on a free port."""
    return Recorder(Sinks(0, rrd), NAMES, **settings)


def feed(target: Recorder, crash: Crash, streams: dict[str, list], run: int = 0, batches: int = 5) -> None:
    """All blocks as a replay would bring them, in some batches, events last."""
    target.put(lambda: test_block(crash))
    count = len(streams[NAMES[0]])
    for i in range(count):
        for name in NAMES:
            target.put(lambda block=streams[name][i]: block._replace(run=run))
        if i % (count // batches) == 0:
            settle(target)
    for name in NAMES:
        for event in events(crash, name, run):
            target.put(lambda event=event: event)
    settle(target)


def settle(target: Recorder, patience: float = PATIENCE) -> None:
    deadline = time.monotonic() + patience
    while not target.idle:
        assert time.monotonic() < deadline, "the recorder does not come to an end"
        time.sleep(0.01)


def rows(path: Path) -> dict[str, int]:
    """Temporal rows of every entity of a recording."""
    found: dict[str, int] = {}
    for chunk in RrdReader(path).stream():
        if not chunk.is_static:
            found[chunk.entity_path] = found.get(chunk.entity_path, 0) + chunk.num_rows
    return found


def column(path: Path, entity: str, component: str) -> tuple[np.ndarray, list[np.ndarray]]:
    """Times (ns) and flat values of a component of an entity, in order of time."""
    rows_: list[tuple[int, np.ndarray]] = []
    for chunk in RrdReader(path).stream():
        if chunk.entity_path == entity and not chunk.is_static:
            batch = chunk.to_record_batch()
            times = batch.column("crash_time").cast("int64").to_pylist()
            rows_ += zip(times, values_of(batch, component))
    rows_.sort(key=lambda row: row[0])
    return np.array([time_ns for time_ns, _ in rows_]), [values for _, values in rows_]


def values_of(batch, component: str) -> list[np.ndarray]:
    """Flat values in each row of a record batch; none where it has no such component."""
    for field, data in zip(batch.schema, batch.columns):
        if (field.metadata or {}).get(b"rerun:component") == component.encode():
            return [np.ravel(row) for row in data.to_pylist()]
    return []


def series(path: Path, entity: str, component: str) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,) and values (n, width) of a component whose rows are alike."""
    times, values = column(path, entity, component)
    return times, np.array(values)


def start_viewer(rrd: Path | str, **parameters: str) -> subprocess.Popen:
    """The node, in a process of its own."""
    command = [sys.executable, "-m", "crash_estimator.nodes.viewer_node", "--ros-args", "-p", f"rrd:={rrd}"]
    for name, value in {"port": 0, "open": "false", **parameters}.items():
        command += ["-p", f"{name}:={value}"]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=dict(os.environ))
