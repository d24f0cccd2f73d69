"""What a node needs of rclpy and the middleware beside its topics."""

import signal
from collections.abc import Callable
from typing import TypeVar

import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import ParameterException
from rclpy.executors import Executor, ExternalShutdownException
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from .fault import guarded, tell
from .middleware import prepare_middleware
from .starting import ENDING

Made = TypeVar("Made", bound=Node)

LOOK = 0.1
"""s between two looks at whether a signal has come."""


def spin(executor: Executor, until: Future) -> None:
    """Run callbacks until the future is done.

    In its place: EventsExecutor.spin() without a time-out keeps a core busy and hardly gets to its callbacks
    (rclpy 7.1: its deadline "never" overflows and is always past).
    """
    while not until.done():
        executor.spin_until_future_complete(until, timeout_sec=3600.0)


def run(
    make: Callable[[], Made],
    until: Callable[[Made], Future] = lambda node: Future(),
    close: Callable[[Made], str | None] = lambda node: None,
) -> int:
    """Make a node and run it until the future is done or a signal ends it -> exit status.

    close: called at the end, gives a line on what is incomplete, which then is the exit status as well.
    """
    return guarded(lambda: _run(make, until, close), also=(ParameterException,))


def _run(make: Callable[[], Made], until: Callable[[Made], Future], close: Callable[[Made], str | None]) -> int:
    # A signal must end the node between two callbacks, not take the context away under the executor.
    signals: list[int] = []
    for number in ENDING:
        if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:  # nohup is respected
            signal.signal(number, lambda number, _: signals.append(number))
    prepare_middleware()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node, executor, incomplete = None, EventsExecutor(), None
    try:
        node = make()
        done = until(node)
        executor.add_node(node)

        def look() -> None:
            if signals and not done.done():
                done.set_result(None)

        # an idle executor runs no Python, and so no signal handler either
        node.create_timer(LOOK, look, clock=Clock(clock_type=ClockType.STEADY_TIME))
        spin(executor, done)
    except ExternalShutdownException:
        pass
    finally:
        executor.shutdown()  # before the node: it holds the node's events, and a late end of it crashes the process
        if node is not None:
            if incomplete := close(node):
                tell(incomplete)
            node.destroy_node()
        rclpy.try_shutdown()
    return 1 if incomplete else 0
