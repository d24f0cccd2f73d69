"""What the codes of an NHTSA test stand for: what a sensor is attached to (SENATT) and at whose seat (SENLOC).

The words are those of NHTSA's code library, turned into names: FMRL, "FEMUR - LEFT", is left_femur. NAMED are shorter
or clearer; READ are not in the library that was at hand, are what their letters and like codes say, and want checking.
A code that is in none keeps its letters as its name, which still tells it from every other.
"""

import re
from typing import NamedTuple

from .nhtsa_library import DATA_STATUS, SEATS, SENSOR_ATTACHMENTS


class Location(NamedTuple):
    """A place in words, and what it moves with: "car", "engine", or "" for a part of its own."""

    name: str
    moves_with: str = ""
    near: bool = True  # False: deforms in the crash, so that it bears witness of the body but is not the body


NAMED = {
    "HDCG": Location("head"),
    "PVCN": Location("pelvis"),
    "PVHP": Location("pelvis_h_point"),
    "PVIL": Location("pelvis_iliac"),
    "HDOT": Location("head_elsewhere"),
    "HD90": Location("head_array_center"),
    "HD9X": Location("head_array_x_arm"),
    "HD9Y": Location("head_array_y_arm"),
    "HD9Z": Location("head_array_z_arm"),
    "LUMB": Location("lumbar_spine"),
    "FLLF": Location("floor_left_front"),
    "FLLR": Location("floor_left_rear"),
    "FLRF": Location("floor_right_front"),
    "FLRR": Location("floor_right_rear"),
    "FLOR": Location("floor"),
    "FLTU": Location("floor_tunnel"),
    "DPLC": Location("dashpanel_center"),
    "DPLL": Location("dashpanel_left"),
    "DPLR": Location("dashpanel_right"),
    "VECG": Location("cg"),
    "OTHR": Location("other"),
}
READ = {
    "FTLF": Location("left_foot_front"),
    "FTLR": Location("left_foot_rear"),
    "FTRF": Location("right_foot_front"),
    "FTRR": Location("right_foot_rear"),
    "VEHC": Location("vehicle", "car"),
    "FLCF": Location("floor_center_front", "car"),
    "FLCR": Location("floor_center_rear", "car"),
    "SILL": Location("left_sill", "car"),
    "SILR": Location("right_sill", "car"),
    "TOEL": Location("left_toepan", "car", near=False),
    "TOER": Location("right_toepan", "car", near=False),
}
MOVES_WITH = (
    (re.compile(r"FLOORPAN|SILL|VEHICLE CG|REAR DECK|TRUNK FLOOR|FRAME CROSSMEMBER - REAR"), "car"),
    (re.compile(r"ENGINE"), "engine"),
)
"""Parts of the passenger cell and behind it, by the library's words."""
VAGUE = ("OTHR", "SEAT", "SEBS", "SETR", "DOOR", "FRAM")
"""Codes that laboratories give to sensors of the passenger cell: there the comment says more."""


def _location(words: str) -> Location:
    """FEMUR - LEFT -> left_femur; SEAT TRACK - LEFT FRONT -> left_front_seat_track."""
    part, _, where = words.partition(" - ")
    name = "_".join(re.findall(r"[a-z0-9]+", f"{where} {part}".lower()))
    return Location(name, next((body for known, body in MOVES_WITH if known.search(words)), ""))


LOCATIONS = {code: _location(words) for code, words in SENSOR_ATTACHMENTS.items()} | READ
LOCATIONS |= {code: LOCATIONS[code]._replace(name=location.name) for code, location in NAMED.items()}

FAMILIES = (
    ("FL", Location("floor", "car")),
    ("SIL", Location("sill", "car")),
    ("TOE", Location("toepan", "car", near=False)),
)
"""What the beginning of a code says where the whole is not known."""
WORDS = (
    ("TOEPAN", FAMILIES[2][1]),
    ("TOE PAN", FAMILIES[2][1]),
    ("SILL", FAMILIES[1][1]),
    ("FLOORPAN", FAMILIES[0][1]),
    ("SEAT CROSSMEMBER", FAMILIES[0][1]),
)
"""What a comment says where the code does not."""

OCCUPANTS = {"01": "driver", "02": "passenger"} | {
    code: "_".join([where, side, "passenger"]).lower()
    for code, (side, where, seat) in ((code, words.split()) for code, words in SEATS.items() if words.count(" ") == 2)
    if seat == "SEAT" and code > "02"
}
INVALID = ("MN", "SF", "CF")
"""Data statuses of signals that say nothing; where the comment says until when, their beginning is valid."""
QUESTIONABLE = "QD"


def code_of_status(words: str) -> str:
    """The code of a data status in the library's words; the words where it has none."""
    return next((code for code, known in DATA_STATUS.items() if known == words), words)


def code_of_attachment(words: str) -> str:
    """The same of a sensor's attachment."""
    return next((code for code, known in SENSOR_ATTACHMENTS.items() if known == words), words)


def location_of(code: str, comment: str) -> Location:
    """Where a sensor is, by its code and, for what it moves with, by its comment."""
    if code in LOCATIONS:
        return _told(comment, LOCATIONS[code].name) if code in VAGUE else LOCATIONS[code]
    named = code.lower().replace(" ", "_") or "unknown"
    for part, family in FAMILIES:
        if code.startswith(part):
            return family._replace(name=named)
    return _told(comment, named)


def _told(comment: str, name: str) -> Location:
    """By the comment, of a code that does not say it."""
    told = next((known for word, known in WORDS if word in comment.upper()), Location(name))
    return told._replace(name=name)


def occupant_of(code: str) -> str:
    """Who carries the sensor: driver, passenger, rear_left_passenger, occupant11, ... or "" for nobody."""
    if code in OCCUPANTS:
        return OCCUPANTS[code]
    if code == "OC":
        return "occupant"
    return f"occupant{code}" if code.isdigit() and int(code) else ""
