"""Small valid inputs of every kind, to be spoilt: files by name, bytes each."""

from array import array
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from crash_msgs.msg import (
    Event,
    Forces,
    Misfit,
    MisfitWindow,
    ParametersBlock,
    RankedEffect,
    Ranking,
    ReplayState,
    ResidualsBlock,
    Revision,
)
from mcap.reader import make_reader
from rclpy.serialization import serialize_message

from crash_replay.bag import time_zero_ns, write_bag
from crash_replay.recording import Channel, Recording, Test
from crash_replay.ros_messages import samples_to_msg, test_to_msg

from ..core.estimate import ROW, sent

Files = dict[str, bytes]

TIME = np.arange(-10, 50) * 100_000
RECORDING = Recording(
    Test(
        "T1",
        (
            Channel("car_ax", "acceleration", "car", "x", "a source"),
            Channel("barrier_fx", "force", "barrier", "x"),
            Channel("travel", "displacement", "car"),
        ),
        "a small test",
        "the fuzzer",
        {"car": 15.0},
        {"car": -0.01},
        ("a note",),
    ),
    TIME,
    np.stack([-100.0 * np.sin(TIME * 1e-7), 1e5 * np.sin(TIME * 1e-7), TIME * 1e-8], axis=1),
)

ROWS = [f"{t * 1e-9:.4f},{a:.4g},{f:.4g}" for t, (a, f, _) in zip(TIME.tolist(), RECORDING.values.tolist())]
CSV: Files = {
    "rib.csv": "\n".join(["time,rib_ay,barrier_fx", *ROWS, ""]).encode(),
    "rib.yaml": b"""test: {id: T1, title: "side impact, padded door", source: "sled 3"}
channels:
  rib_ay: {quantity: acceleration, unit: g, body: rib, axis: y, sign: 1}
  barrier_fx: {quantity: force, unit: N, body: barrier, name: wall_fx}
initial_velocity: {rib: 0.0, barrier: 1.5}
initial_displacement: {rib: -0.02}
""",
}
NAMED: Files = CSV | {
    "names.yaml": b"""test: {id: other, title: "another title", source: here}
channels:
  rib_ay: {name: chest_ay, body: chest, axis: y}
  wall_fx: {body: wall}
initial_velocity: {chest: 2.0}
initial_displacement: {chest: 0.01}
"""
}

CURVE = "".join(f"{k * 1e-4:.6f}\t{np.sin(k / 9):.5f}\n" for k in range(-5, 40)).encode()
CURVES = (
    "1|1|AC|01|HDCG|XL|SEC|G'S|2800|maker|11/AUG/2017|1200|4|57.09|-5|39|100|AM|P|DRIVER HEAD X",
    "1|2|AC|NA|VECG|XG|SEC|G'S|2800|maker|11/AUG/2017|1000|1|57.09|-5|39|100|AM|P|VEHICLE CG X",
    "1|3|DS|01|CHST|XL|SEC|MM|2800|maker|16/AUG/2017|300|8|0.0|-5|39|100|CF|P|CHEST: no valid data after 2.5 ms",
    "0|4|LC|NA|LC01|XG|SEC|NWT|2800|maker|16/AUG/2017|300|8|0.0|-5|39|100|AM|P|CELL A1",
    "0|5|LC|NA|LC02|XG|SEC|NWT|2800|maker|16/AUG/2017|300|8|0.0|-5|39|100|AM|P|CELL A2",
)
EV5: Files = {
    "v1.EV5": "\n".join(
        [
            "# Source: NHTSA Vehicle Database - Test Number: 1",
            "----- EV5 -----",
            "----- TEST -----",
            "V5|title|purpose|03/OCT/2017|MGA|c|ref|NCA|VTB|CON|DRY|22|OTH|OTH|57.09|0|0|0|634|DTS",
            "----- VEHICLE -----",
            "1|16|03|2018|M2|4S|JT|4CIF|2.5|AF|1719|1514|2825|4896|1837|1246",
            "----- INSTRUMENTATION -----",
            *CURVES,
            "",
        ]
    ).encode()
} | {f"v1.{number:03d}": CURVE for number in range(1, 6)}

MME_CHANNEL = """Channel code                :{code}
Name of the channel         :a name
Unit                        :{unit}
Reference channel           :{reference}
Reference channel name      :11TIRS000000TIRP
Sampling interval           :0.0001
Time of first sample        :-0.0002
Data status                 :ok
"""


def _mme(code: str, unit: str, values: np.ndarray, reference: str = "implicit") -> bytes:
    head = MME_CHANNEL.format(code=code, unit=unit, reference=reference)
    return (head + "".join(f"{value:.6E}\n" for value in values)).encode()


MME: Files = {
    "T7.MME": b"""Data format edition number  :1.6
Laboratory name             :A lab
Title                       :a title
Test number                 :T7
Date of the test            :2026-05-14
Velocity test object 1      :15.6
Velocity test object B      :3 km/h
""",
    "Channel/T7.001": _mme("10VEHC000000ACXP", "g", np.sin(np.arange(30.0))),
    "Channel/T7.002": _mme("B0LOCE000000FOX0", "kN", np.arange(30.0)),
    "Channel/T7.003": _mme("11TIRS000000TIRP", "s", np.arange(-2, 28) * 1e-4),
    "Channel/T7.004": _mme("11PELV0000H3ACYP", "m/(s*s)", np.arange(30.0), "explicit"),
}


def bag() -> tuple[Files, list[tuple[str, str, int, bytes]]]:
    """A bag's file, and its messages: topic, type, stamp in ns, CDR."""
    with TemporaryDirectory() as folder:
        data = write_bag(RECORDING, Path(folder) / "small.mcap").read_bytes()
    messages = make_reader(BytesIO(data)).iter_messages()
    return {"small.mcap": data}, [(c.topic, s.name, m.log_time, m.data) for s, c, m in messages]


MODEL: Files = {
    "model.yaml": b"""name: two_mass
bodies:
  car: {mass: 1300, acceleration: [car_ax], noise: 2.0}
  engine: {mass: 400.5, acceleration: engine_ax}
  barrier: {fixed: true, force: barrier_fx}
elements:
  car_barrier:
    between: [car, barrier]
    stiffness: {estimate: true, initial: 4.0e5, min: 0.0, max: 1.0e8, std: 1.0e5, drift: 0.1, shape: curve}
    damping: 1000
    crush_terms: {2: {estimate: true, initial: 10.0}}
  engine_barrier:
    between: [engine, barrier]
    stiffness: {estimate: true, shape: constant}
    tension: none
    unloading: 6.0e5
  car_engine: {between: [car, engine], stiffness: 2.0e6, damping: {estimate: true, initial: 5.0}}
effects:
  - {type: coulomb_friction, element: car_engine, coefficient: 1810, shape: {speed: 0.1}}
  - {type: added_mass, body: car}
  - {type: guide_friction, body: car, coefficient: 900, shape: {speed: 0.2}}
  - {type: initial_velocity, body: car, coefficient: -0.02}
  - {type: channel_gain, channel: engine_ax, coefficient: 0.02}
  - {type: load_path, between: [car, engine], coefficient: 1.0e4, form: one_way}
"""
}
EFFECT: Files = {
    "mine.py": b"""import sys
import numpy as np
from crash_estimator.core.effects.base import BodyForce, ElementForce, Shape, StaticFactor

def force(motion, width=0.1):
    return np.maximum(motion.crush, 0.0) * motion.rate / width

FIRST = ElementForce("position_damping", "N*s/m^2", {"width": Shape("m", 0.01, 1.0, (0.1, 0.5))}, force=force)
SECOND = StaticFactor("hardening", "", factor=lambda rate: np.tanh(rate / 5.0), low=0.0, high=10.0)
THIRD = BodyForce("push", "N", force=lambda time: np.exp(-time / 0.1), size=100.0)
"""
}

TIME_ZERO = time_zero_ns(RECORDING)
TEST_INFO, SAMPLES = test_to_msg(RECORDING), samples_to_msg(RECORDING, 3, 9, 1, TIME_ZERO)
BLOCK = {"run": 1, "number": 3, "time_ns": array("q", [1, 2]), "model": "m", "method": "mrls"}
FOUR = array("d", [1.0, 2.0, 3.0, 4.0])


def _said(*of: str) -> dict[str, Any]:
    """Fields of two samples of two."""
    return {field: [0, 1, 2, 0] if ROW[name].code else FOUR for field, name in sent(*of).items()}


OUTPUT = {
    "block/parameters": ParametersBlock(
        **BLOCK, name=["a", "b"], unit=["N", "N"], **_said("parameters")
    ),
    "block/residuals": ResidualsBlock(
        **BLOCK, name=["a", "b"], unit=["N", "N"], **_said("equations")
    ),
    "forces": Forces(
        **BLOCK, element=["e", "f"], between=["a-b", "b-c"], body=["a", "b"], mass=FOUR[:2],
        **_said("elements", "bodies"),
    ),
    "events": Event(run=1, number=3, time=0.01, kind="loading", target="e", value=1.0, text="a line"),
    "diagnosis/ranking": Ranking(run=1, number=3, ranking=[RankedEffect(effect="x", target="e")], found=["x on e"]),
    "diagnosis/misfit": Misfit(run=1, number=3, windows=[MisfitWindow(start=0.1, end=0.2, body="a")]),
    "diagnosis/revisions": Revision(
        run=1, number=3, time_ns=array("q", [1, 2]), model="m + x on e", revision=1, effects=["x on e"], final=True,
        name=["a"], unit=["N"], measured=FOUR[:2], predicted=FOUR[:2], residual=FOUR[:2], noise_std=FOUR[:2],
    ),
    "replay_state": ReplayState(run=1, number=4, total=60),
}  # fmt: skip
"""What estimators, diagnosis and replay publish, by topic."""


def cdr(message) -> bytes:
    return bytes(serialize_message(message))
