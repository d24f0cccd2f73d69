"""The service `~/get_estimates`: what an estimator has said of some samples once more, for a node that missed it."""

from crash_msgs.msg import Forces, ParametersBlock, ResidualsBlock
from crash_msgs.srv import GetEstimates
from rclpy.node import Node
from rclpy.serialization import deserialize_message

from ..following.columns import FilterFailure
from ..following.follower import Follower
from .estimate_messages import EstimateMessages

SAMPLES = 200
"""At most so many in one answer: some 200 kB, so that what is on its way is not held up."""


class EstimatesAgain:
    def __init__(self, node: Node):
        self.time_zero = 0  # stamp of the impact, ns
        self.of: dict[int, tuple[Follower, EstimateMessages]] = {}  # by revision
        node.create_service(GetEstimates, "~/get_estimates", self._serve)

    def begin_test(self, time_zero: int) -> None:
        self.of.clear()
        self.time_zero = time_zero

    def begin(self, follower: Follower, revision: int) -> None:
        """What is said from now on comes from this model."""
        self.of[revision] = follower, EstimateMessages(follower.estimator.description, revision)

    def _serve(self, request: GetEstimates.Request, response: GetEstimates.Response) -> GetEstimates.Response:
        if request.revision not in self.of:
            known = ", ".join(map(str, self.of)) or "none"
            response.message = f"no estimates of revision {request.revision} on this test; there are: {known}"
            return response
        follower, messages = self.of[request.revision]
        start, stop = request.start, min(request.stop, request.start + SAMPLES, len(follower.kept.seen))
        if start >= stop or not follower.kept.seen[start:stop].all():
            response.message = f"samples {start} to {request.stop - 1} have not all been seen"
            return response
        try:
            columns = follower.again(start, stop)
        except FilterFailure as failure:
            response.message = str(failure)
            return response
        at = self.time_zero + int(columns.time_ns[0]), request.run, columns
        response.success = True
        response.parameters = deserialize_message(messages.parameters(*at), ParametersBlock)
        response.residuals = deserialize_message(messages.residuals(*at), ResidualsBlock)
        response.forces = deserialize_message(messages.forces(*at), Forces)
        return response
