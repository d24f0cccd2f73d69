"""Readable names from ISO-MME channel codes (ISO/TS 13499, RED B), 16 characters:

    1 1 HEAD CG 00 H3 AC X P  -> front_left_head_ax    on front_left_head
    object, position, main location, fine locations 1 to 3 (the third is the dummy), dimension, direction, filter class

Fixed words for the commonest codes, the code itself in lower case for the others.
"""

import re

from ..recording import Channel, RecordingError

DIMENSIONS = {
    "AC": ("acceleration", "a"), "VE": ("velocity", "v"), "DS": ("displacement", "d"), "DC": ("displacement", "d"),
    "FO": ("force", "f"), "MO": ("moment", "m"), "AV": ("angular_velocity", "w"),
}  # fmt: skip
OBJECTS = {"B": "barrier", "M": "mdb", "S": "sled", "P": "pendulum", "H": "impactor"}
POSITIONS = {"1": "front_left", "2": "front_middle", "3": "front_right", "4": "second_left", "6": "second_right"}
LOCATIONS = {
    "HEAD": "head", "NECK": "neck", "SHLD": "shoulder", "CHST": "chest", "STRN": "sternum", "RIBS": "rib",
    "TRRI": "rib", "THSP": "spine", "LUSP": "lumbar_spine", "ABDO": "abdomen", "PELV": "pelvis", "FEMR": "femur",
    "KNEE": "knee", "TIBI": "tibia", "FOOT": "foot", "VEHC": "car", "ENGN": "engine", "DOOR": "door", "SILL": "sill",
    "APIL": "a_pillar", "BPIL": "b_pillar", "CPIL": "c_pillar", "CRME": "crossmember", "SEAT": "seat", "TUNN": "tunnel",
    "FLOR": "floor", "FOOR": "floor", "SPIN": "spine", "STWH": "steering_wheel", "STCL": "steering_column",
}  # fmt: skip
FINE = {
    "LE": "left", "RI": "right", "UP": "upper", "LO": "lower", "MI": "middle", "FR": "front", "RE": "rear",
    "CG": "", "00": "",
}  # fmt: skip
MOVES_WITH = dict.fromkeys(("VEHC", "TUNN", "CRME", "FLOR", "SILL"), "car") | {"ENGN": "engine"}
"""Locations that move with a body that has several: the passenger cell, the engine."""
FILTERED = {"A": "cfc1000", "B": "cfc600", "C": "cfc180", "D": "cfc60"}
"""Filter classes that stand for a CFC; the others say prefiltered or nothing."""


def is_time(code: str) -> bool:
    """A time base: read with the channels that refer to it."""
    return code[12:14] == "TI"


def channel_of(code: str, source: str, several_objects: bool) -> Channel:
    """The channel that a code stands for. Raises RecordingError where no ROS message can carry it."""
    if not re.fullmatch(r"[A-Z0-9?]{16}", code):
        raise RecordingError(f"expected a channel code of 16 letters and digits, found {code!r}")
    if code[12:14] not in DIMENSIONS:
        raise RecordingError(f"dimension {code[12:14]} has no ROS message")
    quantity, letter = DIMENSIONS[code[12:14]]
    of_object = OBJECTS.get(code[0], f"object{code[0]}" if several_objects else "")
    owner = [of_object, POSITIONS.get(code[1], "")]
    fine = [FINE.get(part, part.replace("?", "").lower()) for part in (code[6:8], code[8:10])]
    place = [*owner, LOCATIONS.get(code[2:6], code[2:6].replace("?", "").lower()), *fine]
    axis = code[14].lower() if code[14] in "XYZ" else ""
    moves_with = [of_object, MOVES_WITH[code[2:6]]] if code[2:6] in MOVES_WITH else place
    moves_with = ["barrier"] if code[0] == "B" else moves_with
    return Channel(
        _joined(*place, letter + axis, FILTERED.get(code[15], "")), quantity, _joined(*moves_with), axis, source
    )


def _joined(*words: str) -> str:
    return "_".join(filter(None, words))
