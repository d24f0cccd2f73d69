"""What stands for a node without a graph, and for the others that it would know of there."""

from types import SimpleNamespace


class Silence:
    """A node that is alone."""

    def create_client(self, kind, name):
        return SimpleNamespace(srv_name=name, service_is_ready=lambda: False)

    def create_subscription(self, kind, topic, *given, **more):
        return SimpleNamespace(topic_name=f"/{topic}", get_publisher_count=lambda: 0)

    def create_timer(self, *given, **more):
        pass

    create_service = create_timer


def attending(state=None, **word) -> SimpleNamespace:
    """What is known of the others; word: the last one of each of them, if any."""
    said = SimpleNamespace(**{"done": False, "reason": "", "run": 1, "next": 0, "missing": 0} | word) if word else None
    others = SimpleNamespace(
        word=lambda name: said, state=lambda *given: "there", how=lambda *given: "gone", silence=lambda name: 0.0
    )
    return SimpleNamespace(others=others, replay_state=state)
