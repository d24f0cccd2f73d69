"""YAML files checked against a pydantic model; what is wrong is said in one line with file, line and key.

Reading is safe: a file is data, tags that would construct objects are refused.
"""

from collections.abc import Iterator
from difflib import get_close_matches
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from ruamel.yaml import YAML, YAMLError
from ruamel.yaml.nodes import MappingNode, Node, SequenceNode

from .foreign_text import visible
from .recording import RecordingError

Model = TypeVar("Model", bound=BaseModel)

WORDING = {"missing": "has too few items", "model_type": "should be a mapping", "dict_type": "should be a mapping"}
"""pydantic's error types that it words in Python's terms."""


def load_yaml(path: str | Path, model: type[Model]) -> Model:
    """The file as an instance of `model`, whose unknown keys should be forbidden (`extra="forbid"`).

    Raises RecordingError with one line, for instance
    "door.yaml:7: unknown key 'stifness' in elements.door_rib; did you mean 'stiffness'?".
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise RecordingError(f"{path}: cannot be read as a YAML text file ({_reason(error)})") from None
    try:
        # pure: the C loader reads YAML 1.1, in which the axis `y` is a truth value
        tree = YAML(typ="safe", pure=True).compose(text)
        data = _printable(YAML(typ="safe", pure=True).load(text))
    except YAMLError as error:
        raise RecordingError(f"{path}:{_line_of(error)}: not valid YAML: {_reason(error)}") from None
    if not isinstance(data, dict):
        raise RecordingError(f"{path}:1: expected a mapping with {', '.join(model.model_fields)}; found {_shown(data)}")
    try:
        return model.model_validate(data)
    except ValidationError as invalid:
        # a union reports each of its members: the deepest error belongs to the one that was meant
        error = max(
            invalid.errors(include_url=False),
            key=lambda e: (len(_keys(tree, e["loc"])), e["type"] == "extra_forbidden"),
        )
        raise RecordingError(_message(path, tree, model, error)) from None


def _printable(value: Any) -> Any:
    """The same with texts and keys that can be printed, whatever escapes the file has in its quotes."""
    if isinstance(value, str):
        return visible(value.strip())
    if isinstance(value, dict):
        return {_printable(key): _printable(item) for key, item in value.items()}
    return [_printable(item) for item in value] if isinstance(value, list) else value


def _message(path: Path, tree: Node, model: type[BaseModel], error: dict[str, Any]) -> str:
    """One line for one of pydantic's errors."""
    keys = _keys(tree, error["loc"])
    place = f"{path}:{_line(tree, keys)}"
    if error["type"] == "extra_forbidden":
        known = [name for owner in _models_at(model, keys[:-1]) for name in owner.model_fields]
        return f"{place}: unknown key {keys[-1]!r}{_within(keys[:-1])}; {suggestion(keys[-1], known)}"
    if error["type"] == "missing" and isinstance(error["loc"][-1], str):
        return f"{place}: key {error['loc'][-1]!r} is missing{_within(keys)}"
    what = WORDING.get(error["type"], error["msg"].removeprefix("Value error, ").removeprefix("Input "))
    found = "" if error["type"] == "value_error" else f", found {_shown(error['input'])}"
    return f"{place}: {'.'.join(map(str, keys)) or 'the file'}: {what}{found}"


def suggestion(name: Any, known: list[str]) -> str:
    """The nearest known name as a question, or all of them where none is near."""
    near = get_close_matches(str(name), known, n=1)
    return f"did you mean {near[0]!r}?" if near else f"expected one of {', '.join(dict.fromkeys(known)) or 'none'}"


def _children(node: Node) -> Iterator[tuple[Any, Node, Node]]:
    """(key, node that shows its line, value) of a mapping or sequence."""
    if isinstance(node, MappingNode):
        yield from ((key.value, key, value) for key, value in node.value)
    elif isinstance(node, SequenceNode):
        yield from ((index, value, value) for index, value in enumerate(node.value))


def _keys(tree: Node, location: tuple[Any, ...]) -> list[Any]:
    """The part of pydantic's location that is in the file: without names of union members and missing keys."""
    keys, node = [], tree
    for part in location:
        for key, _, value in _children(node):
            if key == (part if isinstance(node, SequenceNode) else str(part)):
                keys.append(key)
                node = value
                break
    return keys


def _line(tree: Node, keys: list[Any]) -> int:
    """Line of the last of `keys`, counted from 1."""
    line, node = tree.start_mark.line, tree
    for part in keys:
        for key, shown_by, value in _children(node):
            if key == part:
                line, node = shown_by.start_mark.line, value
                break
    return line + 1


def _models_at(annotation: Any, keys: list[Any]) -> list[type[BaseModel]]:
    """The pydantic models that may stand at `keys` below `annotation`."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin in (Union, UnionType):
        return [model for member in arguments for model in _models_at(member, keys)]
    if origin is Annotated:
        return _models_at(arguments[0], keys)
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        if not keys:
            return [annotation]
        field = annotation.model_fields.get(str(keys[0]))
        return _models_at(field.annotation, keys[1:]) if field else []
    if origin and keys:  # dict[str, Model], list[Model], tuple[Model, ...]
        return [model for member in arguments for model in _models_at(member, keys[1:])]
    return []


def _within(keys: list[Any]) -> str:
    return f" in {'.'.join(map(str, keys))}" if keys else ""


def _shown(value: Any) -> str:
    text = "nothing" if value is None else repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _line_of(error: Exception) -> int:
    mark = getattr(error, "problem_mark", None)
    return mark.line + 1 if mark else 1


def _reason(error: Exception) -> str:
    text = getattr(error, "problem", None) or getattr(error, "strerror", None) or str(error)
    return " ".join(text.split())
