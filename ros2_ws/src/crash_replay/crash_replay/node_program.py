"""A node as a command: `--help` says what it does and its parameters, before anything of ROS is imported."""

import sys
from collections.abc import Mapping
from importlib import import_module
from textwrap import fill

from .fault import guarded
from .node_parameters import Allowed
from .said import say

WIDTH = 110
"""Columns of a help text: a line of its node's description is as long."""


def node_program(name: str, about: str, parameters: Mapping[str, Allowed], module: str) -> int:
    """Run `main` of the module, which has the node, unless help is asked for -> exit status."""
    asked = sys.argv[1 : sys.argv.index("--ros-args")] if "--ros-args" in sys.argv else sys.argv[1:]
    if {"-h", "--help"} & set(asked):
        return guarded(lambda: say(help_text(name, about, parameters)))
    return import_module(module).main()


def help_text(name: str, about: str, parameters: Mapping[str, Allowed]) -> str:
    width = max(map(len, parameters), default=0) + 4
    rows = (
        fill(f"{parameter:{width - 2}}{_meaning(allowed)}", WIDTH, initial_indent="  ", subsequent_indent=" " * width)
        for parameter, allowed in parameters.items()
    )
    usage = f"usage: {name} [--ros-args [-p PARAMETER:=VALUE] ... [-r __node:=NAME]]"
    head = ("", "parameters:") if parameters else ()  # none: of its nodes, which say theirs
    return "\n".join((usage, "", about.strip(), *head, *rows))


def _meaning(allowed: Allowed) -> str:
    default = allowed.default
    meaning = f"{allowed.meaning}; may be set at any time" if allowed.live else allowed.meaning
    if default in ("", [""]):
        return meaning
    shown = (
        str(default).lower() if isinstance(default, bool) else f"{default:g}" if isinstance(default, float) else default
    )
    return f"{meaning}; default {shown}"
