"""The nodes of `composed` in one process; `composed_command` says with what."""

import json
import re
import sys
import time
from collections.abc import Sequence
from functools import partial

from rclpy.exceptions import ParameterException
from rclpy.utilities import remove_ros_args

from crash_replay.fault import Fault, guarded, tell
from crash_replay.replay_node import ReplayNode, replay_beside

from .estimator_node import EstimatorNode

LOOK = 0.1
"""s between two looks whether all have said their last word."""


class Usage(Fault):
    """The names are none; the message is one readable line."""


def shared_out(words: Sequence[str], names: Sequence[str]) -> tuple[list[str], dict[str, list[str]]]:
    """Arguments for all nodes, and those of each.

    ROS itself takes `-p NAME:...` for a full name without a namespace only. Of two values of a parameter the last one
    counts, also where one of them is in a file for all nodes.
    """
    shared, own = [], {name: ["--ros-args", "-r", f"__node:={name}"] for name in names}
    rest = iter(words)
    for word in rest:
        value = next(rest, "") if word in ("-p", "--param", "--params-file") else ""
        name, _, parameter = value.partition(":")
        if word in ("-p", "--param") and name in own and not parameter.startswith("="):
            own[name] += [word, parameter]
            continue
        shared += [word, value] if value else [word]
        if word == "--params-file":
            for one in own.values():
                one += [word, value]
    return shared, own


def names_in(words: Sequence[str]) -> list[str]:
    expected = "composed NAME [NAME ...] --ros-args -p replay:bag:=BAG -p NAME:model:=MODEL, each name once"
    names = list(words)
    if not names or len({*names, "replay"}) <= len(names) or not all(re.fullmatch(r"[A-Za-z]\w*", n) for n in names):
        raise Usage(f"expected names of estimators, {expected}; got {' '.join(names) or 'none'}")
    return names


def replay_once(words: Sequence[str]) -> ReplayNode:
    node = ReplayNode(cli_args=words)
    if node.then:
        raise Usage("parameter then: the composed form replays one recording; take `replay` for several")
    return node


def hear_out(replay: ReplayNode, estimators: Sequence[EstimatorNode]) -> int:
    """Stay till nobody wants anything more of the estimators -> exit status."""
    others, limit = replay.topics.audience.attending.others, time.monotonic() + replay.asked["finish_timeout"]
    goes_on = lambda name: others.there(name) and not others.word(name).done  # noqa: E731
    while any(map(goes_on, others.names())) and not replay.pacing.stopped and time.monotonic() < limit:
        time.sleep(LOOK)
    incomplete = [line for estimator in estimators if (line := estimator.attending.leave())]
    for line in incomplete:
        tell(line)
    return 1 if incomplete else 0


def main() -> int:
    return guarded(_main, also=(ParameterException,))


def _main() -> int:
    names = names_in(remove_ros_args(sys.argv)[1:])
    # the replay waits for them, unless the command says who for: at once it finds subscribers that have yet to run
    first = [sys.argv[0], "--ros-args", "-p", f"replay:listeners:={json.dumps(names)}", "--"]
    shared, own = shared_out([*first, *sys.argv[1:]], ["replay", *names])
    estimators = lambda: [EstimatorNode(cli_args=own[name]) for name in names]  # noqa: E731
    return replay_beside(estimators, partial(replay_once, own["replay"]), hear_out, shared)


if __name__ == "__main__":
    sys.exit(main())
