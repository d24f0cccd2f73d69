"""Readable names from ISO-MME channel codes (ISO/TS 13499, RED B), 16 characters:

    1 1 HEAD CG 00 H3 AC X P  -> front_left_head_ax    on front_left_head
    object, position, main location, fine locations 1 to 3 (the third is the dummy), dimension, direction, filter class

The words of the code tables, the code itself in lower case where it is in none.
"""

import re

from ...recording import Channel, RecordingError
from .isomme_library import (
    BELT_PLACES,
    FILTER_CLASSES,
    FINE_LOCATIONS,
    MAIN_LOCATIONS,
    OTHER_SIGN,
    POSITIONS,
    TEST_OBJECTS,
)

DIMENSIONS = {
    "AC": ("acceleration", "a"), "VE": ("velocity", "v"), "VA": ("velocity", "v"), "VD": ("velocity", "v"),
    "DS": ("displacement", "d"), "DC": ("displacement", "d"), "DV": ("displacement", "d"), "FO": ("force", "f"),
    "MO": ("moment", "m"), "AV": ("angular_velocity", "w"),
}  # fmt: skip
"""The quantities that ROS messages carry, with those that were integrated (VA, DV) or differentiated (VD)."""
NAMED = {"VEHC": "car", "TRRI": "rib", "THSP": "spine", "SILB": "sill", "STWH": "steering_wheel"}
"""Shorter than the standard's words."""
MOVES_WITH = dict.fromkeys(
    ("VEHC", "TUNN", "CRME", "SECM", "FLOR", "FOOR", "FLPA", "FORA", "SILL", "SILB"), "car"
) | {"ENGN": "engine"}  # fmt: skip
"""Locations that move with a body that has several: the passenger cell, the engine."""


OF_A_BARRIER = ("LOMA", "FBAR", "WALL")


def is_time(code: str) -> bool:
    """A time base: read with the channels that refer to it."""
    return code[12:14] == "TI"


def object_of(code: str) -> str:
    """The test object's letter; NHTSA's exports have 0 for the barrier, whose sensors the main location tells."""
    return "B" if code[:1] == "0" and code[2:6] in OF_A_BARRIER else code[:1]


def channel_of(code: str, source: str, several_objects: bool) -> Channel:
    """The channel that a code stands for. Raises RecordingError where no ROS message can carry it."""
    if not re.fullmatch(r"[A-Z0-9?]{16}", code):
        raise RecordingError(f"expected a channel code of 16 letters and digits, found {code!r}")
    if code[12:14] not in DIMENSIONS:
        raise RecordingError(f"dimension {code[12:14]} has no ROS message")
    quantity, letter = DIMENSIONS[code[12:14]]
    test_object = object_of(code)
    of_object = TEST_OBJECTS.get(test_object, f"object{test_object}" if several_objects else "")
    owner = [of_object, POSITIONS.get(code[1], "")]
    main = NAMED.get(code[2:6]) or MAIN_LOCATIONS.get(code[2:6], code[2:6].replace("?", "").lower())
    fine = [FINE_LOCATIONS.get(part, part.replace("?", "").lower()) for part in (code[6:8], code[8:10])]
    place = [*owner, main, *fine, BELT_PLACES.get(code[10:12], "")]
    axis = OTHER_SIGN.get(code[14], code[14].lower() if code[14] in "XYZ" else "")
    moves_with = [of_object, MOVES_WITH[code[2:6]]] if code[2:6] in MOVES_WITH else place
    moves_with = ["barrier"] if test_object == "B" else moves_with
    cfc = f"cfc{FILTER_CLASSES[code[15]]}" if code[15] in FILTER_CLASSES else ""
    return Channel(_joined(*place, letter + axis, cfc), quantity, _joined(*moves_with), axis, source)


def other_sign(code: str) -> bool:
    """Whether its direction is one of those whose sign is not that of SAE J211."""
    return code[14] in OTHER_SIGN


def _joined(*words: str) -> str:
    return "_".join(filter(None, words))
