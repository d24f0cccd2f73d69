"""How the viewer fares, for `/diagnostics`."""

from crash_replay.health import Health, Level

from ..viewer.recorder import Recorder

FULL = 0.5
"""Share of the viewer's queue that counts as nearly full."""


def viewer_health(recorder: Recorder) -> Health:
    queue = recorder.queue()
    values = {
        "messages waiting": queue.items,
        "MB waiting": queue.size * 1e-6,
        "messages left out": queue.dropped,
        "server": recorder.sinks.url,
        "file": recorder.sinks.rrd or "none",
    }
    level, message = Level.OK, "draws what comes"
    if queue.items > FULL * recorder.limit:
        level, message = Level.WARN, f"{queue.items} messages wait to be drawn"
    if queue.dropped:
        level, message = Level.WARN, f"{queue.dropped} messages left out of the picture: they came too fast"
    if queue.troubles:
        level, message = Level.WARN, "something cannot be drawn: the log says what"
    return Health(level, message, values, queue.test)
