"""Who listens to a replay: counted as the middleware finds them, and by name as they say of themselves."""

from collections.abc import Sequence

from crash_msgs.msg import Listener
from rclpy.node import Node
from rclpy.publisher import Publisher

from .attendance import GONE, State
from .attending import REPLAY, Attending, Progress
from .subscribers import UNNAMED, killed, node_name


class Audience:
    """Of the node of a replay; a listener is a node that takes part by its own word, see `attendance`."""

    def __init__(self, node: Node, samples: Publisher):
        self.node, self.samples = node, samples
        self.reached = Progress()
        self.attending = Attending(node, REPLAY, lambda: self.reached)
        self.words = self.attending.others
        self.states: dict[str, State] = {}  # as they were looked at last

    def ready(self) -> int:
        """Subscribers on `samples`, but of those that say that they are not ready, and of killed ones.

        A killed one that the middleware has yet to forget stands for none that is still to come.
        """
        preparing = [name for name in self._found() if self.words.state(name) == State.PREPARING]
        gone = len(killed(self.node, self.samples.topic_name))
        return max(0, self.samples.get_subscription_count() - gone - len(preparing))

    def subscribed(self) -> list[str]:
        """Names of the nodes on `samples`."""
        found = self.node.get_subscriptions_info_by_topic(self.samples.topic_name)
        return ["not yet known by name" if info.node_name == UNNAMED else info.node_name for info in found]

    def not_ready(self, names: Sequence[str]) -> list[str]:
        """Nodes of these whose subscription to `samples` is not found, or who have not said that they are ready."""
        ready = {name for name in self._found() if self.words.state(name) in (State.FOLLOWING, State.COMPLETE)}
        return [self._with_reason(name) for name in names if self._full_name(name) not in ready]

    def _with_reason(self, name: str) -> str:
        known = self._full_name(name) if self.words.word(self._full_name(name)) else ""
        return f"{name} ({self.words.how(known, self.words.state(known))})" if known else f"{name} (not heard of)"

    def forget_gone(self) -> None:
        """Who has gone before the first sample takes no part."""
        self.words.forget([name for name in self.words.names() if self.words.state(name) in GONE])

    def behind(self, run: int, sent: int) -> list[str]:
        """Listeners that are there and lack some of the samples before number `sent` of a pass."""
        through = (*GONE, State.COMPLETE)
        return [name for name in self._listeners() if self.words.state(name, run, sent) not in through]

    def lacking(self, run: int, sent: int) -> list[str]:
        """A line on each listener that lacks some of these samples, also where it has left by its own will.

        It says so itself, but its terminal may be closed, and its disk full.
        """
        found = {name: self.words.lacks(name, run, sent) for name in self._listeners()}
        return [f"{name} has {lacks}" for name, lacks in found.items() if lacks]

    def look(self, reached: Progress) -> list[Listener]:
        """The listeners, where the replay has come so far; who has fallen silent or was killed is said, once."""
        self.reached = reached
        states = {name: self.words.state(name, reached.run, reached.next) for name in self._listeners()}
        for name, state in states.items():
            before = self.states.get(name)
            if state in (State.SILENT, State.KILLED) and state != before:
                self.warn(f"{name} {self.words.how(name, state)}")
            elif before in (State.SILENT, State.KILLED) and state not in (*GONE, State.SILENT):
                self.node.get_logger().info(f"{name} is back")
        self.states = states
        return [self._listener(name, state) for name, state in states.items()]

    def warn(self, text: str) -> None:
        self.node.get_logger().warning(text)

    def leave(self) -> None:
        """Nothing more can be had of this replay."""
        if not self.attending.own.leaving:
            self.attending.leave()

    def _listeners(self) -> list[str]:
        replays = self.words.names(REPLAY)
        return [name for name in self.words.names() if name not in replays]

    def _found(self) -> set[str]:
        """Nodes that take part and whose subscription to `samples` is found."""
        found = {node_name(info) for info in self.node.get_subscriptions_info_by_topic(self.samples.topic_name)}
        return found & set(self.words.names())

    def _full_name(self, name: str) -> str:
        return name if name.startswith("/") else f"{self.node.get_namespace().rstrip('/')}/{name}"

    def _listener(self, name: str, state: State) -> Listener:
        word = self.words.word(name)
        said = {field: getattr(word, field) for field in ("node", "role", "run", "next", "missing", "reason")}
        return Listener(state=int(state), **said)
