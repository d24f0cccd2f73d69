"""The service `~/get_samples`: samples of the recording once more, whatever the replay is doing."""

from crash_msgs.srv import GetSamples
from rclpy.node import Node

from .recording import Recording
from .ros_messages import samples_to_msg, time_zero_ns

BYTES = 250_000
"""At most so much in one answer, so that samples on their way are not held up."""


def serve_samples(node: Node, recording: Recording) -> None:
    most = max(1, BYTES // (8 * (1 + len(recording.test.channels))))
    time_zero = time_zero_ns(recording)

    def serve(request: GetSamples.Request, response: GetSamples.Response) -> GetSamples.Response:
        start, stop = request.start, min(request.stop, len(recording), request.start + most)
        if start < stop:
            response.success, response.samples = True, samples_to_msg(recording, start, stop, 0, time_zero)
        else:
            response.message = f"no samples {start} to {request.stop}: the recording has {len(recording)}"
        return response

    node.create_service(GetSamples, "~/get_samples", serve)
