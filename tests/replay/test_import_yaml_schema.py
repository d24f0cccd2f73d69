"""YAML against a schema: every mistake is one line with file, line, key and what to do."""

from typing import Literal

import pytest
from pydantic import BaseModel, ConfigDict, PositiveFloat, field_validator

from crash_replay.recording import RecordingError
from crash_replay.yaml_schema import load_yaml


class Part(BaseModel):
    model_config = ConfigDict(extra="forbid")


class Coefficient(Part):
    estimate: bool = False
    initial: float = 0.0


class Element(Part):
    between: tuple[str, str]
    stiffness: float | Coefficient
    tension: Literal["none", "both"] = "both"

    @field_validator("between")
    @classmethod
    def _two(cls, between):
        if between[0] == between[1]:
            raise ValueError("must name two different bodies")
        return between


class Body(Part):
    mass: PositiveFloat | None = None


class File(Part):
    name: str
    bodies: dict[str, Body] = {}
    elements: dict[str, Element] = {}
    effects: list[Element] = []


GOOD = """\
# a comment
name: door
bodies:
  rib: {mass: 16.8}
  y: {mass: 1e3}
elements:
  door_rib:
    between: [door, rib]
    stiffness: 1.0e5
    tension: none
  rib_spine: {between: [rib, spine], stiffness: {estimate: true, initial: 2}}
"""


def test_good_file(tmp_path):
    path = tmp_path / "door.yaml"
    path.write_text(GOOD, encoding="utf-8-sig")
    model = load_yaml(path, File)
    assert model.bodies["y"].mass == 1000.0  # the name y is a name, not a truth value
    assert model.elements["door_rib"].stiffness == 1.0e5 and model.elements["rib_spine"].stiffness.initial == 2.0


MISTAKES = [
    (
        "    stiffness: 1",
        "    stifness: 1",
        "9: unknown key 'stifness' in elements.door_rib; did you mean 'stiffness'?",
    ),
    ("bodies:", "bodys:", "3: unknown key 'bodys'; did you mean 'bodies'?"),
    ("estimate:", "qq:", "11: unknown key 'qq' in elements.rib_spine.stiffness; expected one of estimate, initial"),
    ("    tension: none", "    initial: 2", "10: unknown key 'initial' in elements.door_rib; it belongs in stiffness"),
    ("name: door", "", "3: key 'name' is missing"),
    ("    between: [door, rib]", "", "7: key 'between' is missing in elements.door_rib"),
    (
        "16.8",
        "heavy",
        "4: bodies.rib.mass: should be a valid number, unable to parse string as a number, found 'heavy'",
    ),
    ("16.8", "-3", "4: bodies.rib.mass: should be greater than 0, found -3"),
    ("none", "non", "10: elements.door_rib.tension: should be 'none' or 'both', found 'non'"),
    ("[door, rib]", "[door, door]", "8: elements.door_rib.between: must name two different bodies"),
    ("[door, rib]", "[door]", "8: elements.door_rib.between: has too few items, found ['door']"),
    ("  rib: {mass: 16.8}", "  rib: 16.8", "4: bodies.rib: should be a mapping, found 16.8"),
    ("  door_rib:", "  door_rib: &a", None),  # anchors are fine
    (
        "    tension: none",
        "    tension: none\n    tension: both",
        "11: not valid YAML: key 'tension' appears more than once",
    ),
    ("[door, rib]", "[door, rib", "9: not valid YAML: "),
    ("16.8", "2019-13-04", "4: not valid YAML: '2019-13-04' is no date (month must be in 1..12)"),
    (
        "door\n",
        "!!python/object/apply:os.getcwd []\n",
        "2: not valid YAML: could not determine a constructor for the tag",
    ),
]


@pytest.mark.parametrize("good, bad, expected", MISTAKES)
def test_mistakes(tmp_path, good, bad, expected):
    assert good in GOOD
    path = tmp_path / "door.yaml"
    path.write_text(GOOD.replace(good, bad, 1))
    if expected is None:
        load_yaml(path, File)
        return
    with pytest.raises(RecordingError) as raised:
        load_yaml(path, File)
    assert str(raised.value).startswith(f"{path}:{expected}")
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("text", ["", "[1, 2]", "words", "3"])
def test_not_a_mapping(tmp_path, text):
    (tmp_path / "f.yaml").write_text(text)
    with pytest.raises(
        RecordingError, match="f.yaml:1: expected a mapping with name, bodies, elements, effects; found"
    ):
        load_yaml(tmp_path / "f.yaml", File)


def test_not_a_text_file(tmp_path):
    with pytest.raises(RecordingError, match="no.yaml: cannot be read as a YAML text file"):
        load_yaml(tmp_path / "no.yaml", File)
    (tmp_path / "b.yaml").write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(RecordingError, match="b.yaml: cannot be read as a YAML text file"):
        load_yaml(tmp_path / "b.yaml", File)


def test_key_in_a_list_of_mappings(tmp_path):
    (tmp_path / "f.yaml").write_text(
        "name: a\neffects:\n  - {between: [a, b], stiffness: 1}\n  - {between: [a, b], stifnes: 1}\n"
    )
    with pytest.raises(
        RecordingError, match=r"f.yaml:4: unknown key 'stifnes' in effects.1; did you mean 'stiffness'\?"
    ):
        load_yaml(tmp_path / "f.yaml", File)
