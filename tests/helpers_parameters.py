"""The tables of parameters in the README, made from those that the nodes declare."""

import re
from collections.abc import Mapping

from crash_estimator.core.methods import METHODS
from crash_estimator.nodes import diagnosis_parameters, estimator_parameters, viewer_parameters
from crash_estimator.nodes.estimator_parameters import DAMPING_AFTER, PREFIX, PRESET, settings_of
from crash_replay import record_parameters, replay_parameters
from crash_replay.node_parameters import Allowed, expected

TABLES = {
    "replay": replay_parameters.PARAMETERS,
    "record": record_parameters.PARAMETERS,
    "estimator": estimator_parameters.PARAMETERS,
    "diagnosis": diagnosis_parameters.PARAMETERS,
    "viewer": viewer_parameters.PARAMETERS,
}
"""Of each node; the estimator has its method's settings besides."""


def tables() -> str:
    """All of them, as the README has them."""
    parts = [
        _table(f"parameter of `{node}`", {f"`{name}`": one for name, one in table.items()})
        for node, table in TABLES.items()
    ]
    return "\n\n".join([*parts, _table("setting of a method", _settings())])


def _settings() -> dict[str, Allowed]:
    """Methods whose settings are all the same have one row for each."""
    rows: dict[tuple[str, Allowed], list[str]] = {}
    for method in METHODS:
        for name, allowed in settings_of(method).items():
            rows.setdefault((name, allowed), []).append(method)
    of_most = f"{PREFIX}damping_after"
    rows[of_most, DAMPING_AFTER._replace(live=True)] = ["all but effective_mass"]
    rows[f"{PREFIX}preset", PRESET] = ["all"]
    return {f"`{name}` ({', '.join(methods)})": allowed for (name, allowed), methods in rows.items()}


def _table(head: str, rows: Mapping[str, Allowed]) -> str:
    lines = [f"| {head} | default | may be | |", "|---|---|---|---|"]
    for name, allowed in rows.items():
        live = "*live*; " if allowed.live else ""
        lines.append(f"| {name} | {_default(allowed)} | {_kind(allowed)} | {live}{allowed.meaning} |")
    return "\n".join(lines)


def _default(allowed: Allowed) -> str:
    value = allowed.default
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list):
        return ""
    return f"{value:g}" if isinstance(value, float) else str(value)


def _kind(allowed: Allowed) -> str:
    return re.sub(r"^an? ", "", expected(allowed)).removesuffix(" of the right form")


if __name__ == "__main__":
    print(tables())
