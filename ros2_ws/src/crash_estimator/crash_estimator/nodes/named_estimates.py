"""What is estimated after one sample, by name: `~/parameters`, `~/residuals`, and a topic for each value asked for.

The blocks are for programs that want all of it fast; these are for plots, `ros2 topic echo` and nodes of others.
They are made only while somebody listens, and hold the same numbers to the last bit.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from fnmatch import fnmatchcase

from crash_msgs.msg import Equation, Parameter, Parameters, ParametersBlock, Residuals, ResidualsBlock
from rclpy.node import Node
from rclpy.publisher import Publisher
from std_msgs.msg import Float64

from crash_replay.cdr import Serialized
from crash_replay.qos import STREAM

from ..core.estimate import Description
from ..following.columns import Columns
from .estimate_messages import FIELDS


class NamedTopics:
    def __init__(self, node: Node, with_topics: Sequence[str]):
        """with_topics: parameters, names or patterns such as *.stiffness, that get a topic of their own."""
        self.node, self.with_topics = node, with_topics
        self.parameters = node.create_publisher(Parameters, "~/parameters", STREAM)
        self.residuals = node.create_publisher(Residuals, "~/residuals", STREAM)
        self.streams = (self.parameters, self.residuals)
        self.values: dict[str, Publisher] = {}  # by parameter
        self.names: tuple[str, ...] = ()

    def begin(self, description: Description, revision: int) -> None:
        """What follows comes from this model."""
        self.messages = NamedMessages(description, revision)
        self.names = (*description.parameters, *description.extra)
        wanted = [name for name in self.names if any(fnmatchcase(name, one) for one in self.with_topics)]
        for name in [name for name in self.values if name not in wanted]:
            self.node.destroy_publisher(self.values.pop(name))
        for name in wanted:
            if name not in self.values:
                self.values[name] = self.node.create_publisher(Float64, f"~/parameters/{topic_of(name)}", STREAM)

    def publish(self, run: int, columns: Columns, stamp_ns: int, sent: Callable[[int], None]) -> None:
        """stamp_ns: of the first sample; sent: is told the size of each message and may wait."""
        for publisher, messages in (
            (self.parameters, self.messages.parameters),
            (self.residuals, self.messages.residuals),
        ):
            if publisher.get_subscription_count():
                for message in messages(stamp_ns, run, columns):
                    publisher.publish(message)
                    sent(len(message))
        for name, publisher in self.values.items():
            if publisher.get_subscription_count():
                for value in columns.of["value"][:, self.names.index(name)].tolist():
                    publisher.publish(Float64(data=value))
                    sent(12)


def topic_of(parameter: str) -> str:
    """The last part of its topic: "rib_spine.stiffness" -> "rib_spine/stiffness", what no topic may have as "_"."""
    words = (re.sub(r"\W", "_", word, flags=re.ASCII) for word in parameter.split("."))
    return "/".join(f"_{word}" if word[:1].isdigit() else word or "_" for word in words)


class NamedMessages:
    """Messages of one sample each, serialised: their texts are made once."""

    def __init__(self, description: Description, revision: int = 0):
        d = description
        names, units = (*d.parameters, *d.extra), (*d.parameter_units, *d.extra_units)
        head = {"model": d.model, "method": d.method, "revision": revision}
        entries = [Parameter(name=name, unit=unit) for name, unit in zip(names, units)]
        self.parameters = Entries(Parameters(parameters=entries, **head), "parameters", FIELDS[ParametersBlock])
        entries = [Equation(name=name, unit=unit) for name, unit in zip(d.equations, d.equation_units)]
        self.residuals = Entries(Residuals(equations=entries, **head), "equations", FIELDS[ResidualsBlock])


class Entries:
    """A serialised message with named entries, filled again for each sample."""

    def __init__(self, empty: Parameters | Residuals, entries: str, fields: Iterable[str]):
        empty.header.frame_id = empty.model
        self.message = Serialized(empty)
        numbers = self.message.numbers
        self.run, self.number, self.time = numbers["run"], numbers["number"], numbers["time"]
        count = range(len(getattr(empty, entries)))
        self.places = {field: [numbers[f"{entries}[{k}].{field}"] for k in count] for field in fields}

    def __call__(self, stamp_ns: int, run: int, columns: Columns) -> Iterator[bytes]:
        """stamp_ns: of the first of the samples."""
        tables = [(places, columns.of[field].tolist()) for field, places in self.places.items()]
        times = columns.time_ns.tolist()
        self.run[0] = run
        for row, time_ns in enumerate(times):
            self.message.set_stamp(stamp_ns + time_ns - times[0])
            self.number[0], self.time[0] = columns.number + row, time_ns * 1e-9
            for places, table in tables:
                for place, value in zip(places, table[row]):
                    place[0] = value
            yield bytes(self.message)
