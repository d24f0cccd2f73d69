"""YAML files checked against a pydantic model; what is wrong is said in one line with file, line and key."""

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, NamedTuple, TypeVar, Union, get_args, get_origin

from pydantic import AfterValidator, BaseModel, BeforeValidator, ValidationError
from ruamel.yaml.nodes import Node, SequenceNode

from . import limits
from .limits import Range, shown
from .recording import RecordingError
from .yaml_tree import children, parsed

Model = TypeVar("Model", bound=BaseModel)

WORDING = {"missing": "has too few items", "model_type": "should be a mapping", "dict_type": "should be a mapping"}
"""pydantic's error types that it words in Python's terms."""


def number(limit: Range) -> Any:
    """The type of a key that takes a number within a limit: not text, nor `true`, which Python counts as 1."""

    def checked(value: Any) -> Any:
        if wrong := limit.wrong(value):
            raise ValueError(wrong)
        return value

    return Annotated[float, BeforeValidator(checked)]


Text = Annotated[str, AfterValidator(lambda text: _checked_text(text))]
"""The type of a key that takes a text: of one line that can be shown."""


def _checked_text(text: str) -> str:
    if wrong := limits.text_wrong([text]):
        raise ValueError(wrong)
    if not text.isprintable():
        raise ValueError(f"must be text of one line without control characters, found {shown(text)}")
    return text


class Read(NamedTuple):
    """A YAML file that has been read: as an instance of its model, and where its keys are."""

    path: Path
    content: Any
    tree: Node

    def place(self, keys: Sequence[Any]) -> str:
        """ "door.yaml:7: elements.door_rib.between", of the last of `keys` that the file has."""
        found = _keys(self.tree, tuple(keys))
        return f"{self.path}:{_line(self.tree, found)}: {'.'.join(map(str, found)) or 'the file'}"


def load_yaml(path: str | Path, model: type[Model]) -> Model:
    """The file as an instance of `model`, whose unknown keys should be forbidden (`extra="forbid"`).

    Raises RecordingError with one line, for instance
    "door.yaml:7: unknown key 'stifness' in elements.door_rib; did you mean 'stiffness'?".
    """
    return read_yaml(path, model).content


def read_yaml(path: str | Path, model: type[Model]) -> Read:
    """As `load_yaml`, for one who finds more wrong with it later and is to say where."""
    path = Path(path)
    tree, data = parsed(path)
    if not isinstance(data, dict):
        raise RecordingError(f"{path}:1: expected a mapping with {', '.join(model.model_fields)}; found {shown(data)}")
    try:
        return Read(path, model.model_validate(data), tree)
    except ValidationError as invalid:
        # a union reports each of its members: the deepest error belongs to the one that was meant
        error = max(
            invalid.errors(include_url=False),
            key=lambda e: (len(_keys(tree, e["loc"])), e["type"] == "extra_forbidden"),
        )
        raise RecordingError(_message(path, tree, model, error)) from None


def _message(path: Path, tree: Node, model: type[BaseModel], error: Mapping[str, Any]) -> str:
    """One line for one of pydantic's errors."""
    keys = _keys(tree, error["loc"])
    place = f"{path}:{_line(tree, keys)}"
    if error["type"] == "extra_forbidden":
        owners = _models_at(model, keys[:-1])
        known = [name for owner in owners for name in owner.model_fields]
        deeper = [name for owner in owners for name in _with_key(owner, keys[-1])]
        hint = f"it belongs in {' or '.join(deeper)}" if deeper else suggestion(keys[-1], known)
        return f"{place}: unknown key {shown(keys[-1])}{_within(keys[:-1])}; {hint}"
    if error["type"] == "missing" and isinstance(error["loc"][-1], str):
        return f"{place}: key {error['loc'][-1]!r} is missing{_within(keys)}"
    what = WORDING.get(error["type"], error["msg"].removeprefix("Value error, ").removeprefix("Input "))
    found = "" if error["type"] == "value_error" else f", found {shown(error['input'])}"
    return f"{place}: {'.'.join(map(str, keys)) or 'the file'}: {what}{found}"


def suggestion(name: Any, known: list[str]) -> str:
    """The nearest known name as a question, or all of them where none is near."""
    near = get_close_matches(str(name), known, n=1)
    return f"did you mean {near[0]!r}?" if near else f"expected one of {', '.join(dict.fromkeys(known)) or 'none'}"


def _keys(tree: Node, location: tuple[Any, ...]) -> list[Any]:
    """The part of pydantic's location that is in the file: without names of union members and missing keys."""
    keys, node = [], tree
    for part in location:
        for key, _, value in children(node):
            if key == (part if isinstance(node, SequenceNode) else str(part)):
                keys.append(key)
                node = value
                break
    return keys


def _line(tree: Node, keys: list[Any]) -> int:
    """Line of the last of `keys`, counted from 1."""
    line, node = tree.start_mark.line, tree
    for part in keys:
        for key, shown_by, value in children(node):
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


def _with_key(model: type[BaseModel], key: Any) -> list[str]:
    """Its fields that have the key among their own."""
    fields = model.model_fields.items()
    return [name for name, field in fields if any(key in one.model_fields for one in _models_at(field.annotation, []))]


def _within(keys: list[Any]) -> str:
    return f" in {'.'.join(map(str, keys))}" if keys else ""
