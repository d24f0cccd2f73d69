"""What a diagnosis publishes of its answers, and logs of the final ones."""

from typing import TYPE_CHECKING

import numpy as np
from crash_msgs.msg import Misfit, Ranking, Revision
from rclpy.node import Node

from crash_replay.qos import SAID
from crash_replay.ros_messages import stamp

from ..core.structure import Structure
from ..kept import Kept
from .diagnosis_messages import Moment, misfit_message, ranking_message, revision_message, revision_name
from .diagnosis_story import Told, story

if TYPE_CHECKING:  # an answer brings it along
    from ..core.diagnosis import OnlineAnswer


class Telling:
    def __init__(self, node: Node, given: Structure):
        """given: the model that revisions are named by."""
        self.node, self.given = node, given
        self.ranking_out = node.create_publisher(Ranking, "~/ranking", SAID)
        self.misfit_out = node.create_publisher(Misfit, "~/misfit", SAID)
        self.revisions_out = node.create_publisher(Revision, "~/revisions", SAID)
        self.told: dict[int, Told] = {}  # final answers by revision
        self.drawn = 0  # number of the first sample that no curve has been published of in this pass
        self.last = ""  # what was told last in this pass

    def begin_test(self) -> None:
        self.told.clear()

    def begin_pass(self) -> None:
        self.drawn, self.last = 0, ""

    def name(self, structure: Structure) -> str:
        return revision_name(self.given, structure, ())

    def tell(self, at: Moment, answer: "OnlineAnswer", kept: Kept, time_zero: int) -> None:
        """kept: the samples it rests on; time_zero: stamp of the impact, ns."""
        self.ranking_out.publish(ranking_message(at, answer))
        self.misfit_out.publish(misfit_message(at, answer))
        numbers = kept.numbers(at.number + 1)[-len(answer.fits[0].time_ns) :]
        rows = slice(0 if at.final else int(np.searchsorted(numbers, self.drawn)), None)
        self.drawn = at.number + 1
        self.last = f"{answer.verdict}, {'final' if at.final else f'up to sample {at.number}'}"
        for fit in answer.fits:
            name = revision_name(self.given, at.structure, fit.effects)
            first = stamp(time_zero + int(fit.time_ns[rows][0]))
            self.revisions_out.publish(revision_message(at, name, int(numbers[rows][0]), first, fit, rows))
        if at.final:
            self._tell_story(at, answer, kept.missing(at.number + 1))

    def _tell_story(self, at: Moment, answer: "OnlineAnswer", missing: int) -> None:
        self.told[at.revision] = Told(self.name(at.structure), answer)
        for line in story([told for _, told in sorted(self.told.items())]):
            self.node.get_logger().info(line)
        if missing:
            self.node.get_logger().warning(f"{missing} samples were not seen: the offline answer may differ")
