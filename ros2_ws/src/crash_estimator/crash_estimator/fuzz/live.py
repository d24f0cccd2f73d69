"""The estimator's and the diagnosis's own nodes in this process: what they hear is handed to their callbacks."""

import atexit
from functools import cache
from pathlib import Path
from random import Random
from tempfile import mkdtemp

import rclpy
from rclpy.logging import LoggingSeverity
from rclpy.node import Node
from rclpy.parameter import Parameter

from crash_replay.ros_messages import samples_to_msg

from ..demo.domain import free_domain
from ..nodes.diagnosis_node import DiagnosisNode
from ..nodes.estimator_node import EstimatorNode
from .mutations import spoilt_message
from .valid import RECORDING, SAMPLES, TEST_INFO, TIME_ZERO, Files, cdr

MODEL = """name: oscillator
bodies:
  car: {mass: 1000, acceleration: car_ax}
  wall: {fixed: true, force: barrier_fx}
elements:
  spring: {between: [car, wall], stiffness: {estimate: true, initial: 1.0e5, min: 0.0}, displacement: travel}
"""
KINDS: dict[str, type[EstimatorNode] | type[DiagnosisNode]] = {"estimator": EstimatorNode, "diagnosis": DiagnosisNode}
FOLLOWED = 10
"""Samples of the valid test that comes after each spoilt one."""


@cache
def node(kind: str) -> EstimatorNode | DiagnosisNode:
    """Ready to hear; made once."""
    if not rclpy.ok():
        rclpy.init(domain_id=free_domain())
        atexit.register(rclpy.try_shutdown)
    model = Path(mkdtemp(prefix="fuzz-")) / "oscillator.yaml"
    model.write_text(MODEL)
    made = KINDS[kind](parameter_overrides=[Parameter("model", value=str(model))])
    made.get_logger().set_level(LoggingSeverity.FATAL)
    if isinstance(made, DiagnosisNode):  # nothing is asked of its process, which need not get ready
        made.worker.close()
        made.worker.busy = False
        made._look()  # subscribes to the samples
    return made


def spoil(rng: Random) -> Files:
    """A few messages in a row; their names say on which topic."""
    files = {}
    for place in range(rng.choice((1, 2, 5))):
        topic = rng.choice(("test", "samples", "samples"))
        message = (
            TEST_INFO if topic == "test" else samples_to_msg(RECORDING, *_part(rng), rng.choice((0, 1)), TIME_ZERO)
        )
        files[f"{place}.{topic}"] = spoilt_message(rng, message)
    return files


def _part(rng: Random) -> tuple[int, int]:
    start = rng.randrange(len(RECORDING) - 1)
    return start, rng.randrange(start + 1, len(RECORDING) + 1)


def take(kind: str, folder: Path) -> None:
    """The messages, then a valid test: the node is to live, and to follow that."""
    made = node(kind)
    hear(made, "test", cdr(TEST_INFO))
    for file in sorted(folder.iterdir()):
        hear(made, file.suffix[1:], file.read_bytes())
    hear(made, "test", cdr(TEST_INFO))
    hear(made, "samples", cdr(samples_to_msg(RECORDING, 0, FOLLOWED, SAMPLES.run + 1, TIME_ZERO)))
    reached = made.follower.position if isinstance(made, EstimatorNode) else made.end
    if reached != FOLLOWED:
        raise AssertionError(f"after it the node follows a valid test to sample {reached}, not to {FOLLOWED}")


def hear(made: Node, topic: str, raw: bytes) -> None:
    next(s for s in made.subscriptions if s.topic_name == f"/{topic}").callback(raw)
