"""A YAML file as a tree of nodes with their lines, and what it says; no larger or deeper than ours can be.

Reading is safe: a file is data, tags that would construct objects are refused.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML, YAMLError
from ruamel.yaml.events import CollectionEndEvent, CollectionStartEvent, Event
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from . import limits
from .foreign_text import visible
from .limits import shown
from .recording import RecordingError


class NotOurs(Exception):
    """A file is too deep, has too many parts once its anchors are written out, or a key twice."""

    def __init__(self, where: Event | Node, problem: str):
        super().__init__(problem)
        self.problem_mark, self.problem = where.start_mark, problem


def parsed(path: Path) -> tuple[Node | None, Any]:
    """The tree and what it says; None for an empty file. Raises RecordingError with one line."""
    text = _text_of(path)
    # pure: the C loader reads YAML 1.1, in which the axis `y` is a truth value
    yaml = YAML(typ="safe", pure=True)
    try:
        _check_nesting(yaml.parse(text))
        tree = yaml.compose(text)
        if tree is None:
            return None, None
        _check_tree(tree)
        _check_dates(yaml, tree)
        return tree, _printable(yaml.constructor.construct_document(tree))
    except (YAMLError, NotOurs) as error:
        raise RecordingError(f"{path}:{_line_of(error)}: not valid YAML: {_reason(error)}") from None
    except Exception as error:  # what the parser stumbles over: a date that is none, a number of 5000 digits
        raise RecordingError(f"{path}: not valid YAML: {shown(str(error))}") from None


def _printable(value: Any) -> Any:
    """The same with texts and keys that can be printed, whatever escapes the file has in its quotes."""
    if isinstance(value, str):
        return visible(value.strip())
    if isinstance(value, dict):
        return {_printable(key): _printable(item) for key, item in value.items()}
    return [_printable(item) for item in value] if isinstance(value, list) else value


def _check_dates(yaml: YAML, tree: Node) -> None:
    """Raises NotOurs for what is written as a date and is none."""
    seen, left = set(), [tree]
    while left:
        node = left.pop()
        if id(node) in seen:  # of an anchor and its aliases
            continue
        seen.add(id(node))
        left += (value for _, _, value in children(node))
        if isinstance(node, ScalarNode) and node.tag.endswith(":timestamp"):
            try:
                yaml.constructor.construct_object(node)
            except ValueError as error:
                raise NotOurs(node, f"{shown(node.value)} is no date ({error})") from None


def children(node: Node) -> Iterator[tuple[Any, Node, Node]]:
    """(key, node that shows its line, value) of a mapping or sequence."""
    if isinstance(node, MappingNode):
        yield from ((key.value, key, value) for key, value in node.value)
    elif isinstance(node, SequenceNode):
        yield from ((index, value, value) for index, value in enumerate(node.value))


def _text_of(path: Path) -> str:
    try:
        if wrong := limits.file_wrong(path, limits.YAML_FILE):
            raise RecordingError(f"{path}: {wrong}: it cannot be a YAML file of ours")
        return path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise RecordingError(f"{path}: cannot be read as a YAML text file ({_reason(error)})") from None


def _check_nesting(events: Iterator[Event]) -> None:
    """As the text is scanned: to go on with thousands of brackets would take minutes, or all of Python's stack."""
    depth = 0
    for count, event in enumerate(events):
        depth += isinstance(event, CollectionStartEvent) - isinstance(event, CollectionEndEvent)
        if depth > limits.YAML_DEPTH.highest:
            raise NotOurs(event, f"nested deeper than the {limits.YAML_DEPTH.highest} levels allowed")
        if wrong := limits.count_wrong("has", count, limits.YAML_PARTS):
            raise NotOurs(event, wrong)


def _check_tree(tree: Node) -> None:
    """Before anything is made of it: nine anchors of nine aliases each are a thousand million parts."""
    sizes: dict[int, int] = {}  # parts, by node; 0 while it is being counted

    def parts(node: Node) -> int:
        known = sizes.get(id(node))
        if known == 0:
            raise NotOurs(node, "an anchor contains itself")
        if known is None:
            sizes[id(node)] = 0
            keys = [key for key, _ in node.value] if isinstance(node, MappingNode) else []
            _check_keys(keys)
            known = 1 + sum(map(parts, keys)) + sum(parts(value) for _, _, value in children(node))
            sizes[id(node)] = known
        if wrong := limits.count_wrong("has", known, limits.YAML_PARTS):
            raise NotOurs(node, wrong)
        return known

    parts(tree)


def _check_keys(keys: list[Node]) -> None:
    """A key that stands twice: thousands of them would take the constructor minutes to find."""
    seen = set()
    for key in keys:
        if isinstance(key, ScalarNode):
            if key.value in seen and key.value != "<<":
                raise NotOurs(key, f"key {shown(key.value)} appears more than once")
            seen.add(key.value)


def _line_of(error: Exception) -> int:
    mark = getattr(error, "problem_mark", None)
    return mark.line + 1 if mark else 1


def _reason(error: Exception) -> str:
    text = getattr(error, "problem", None) or getattr(error, "strerror", None) or str(error)
    return " ".join(text.split())
