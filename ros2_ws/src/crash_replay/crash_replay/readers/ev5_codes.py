"""What the codes of an EV5 header stand for: what a sensor is attached to (SENATT) and at whose seat (SENLOC).

The codes are of NHTSA's test reference guide, version 5, which was not at hand: SEEN stand in headers beside a comment
that says what they are (NHTSA's test 10146); READ are what their letters and like codes say, and want checking. A code
that is in neither keeps its letters as its name, which still tells it from every other.
"""

from typing import NamedTuple


class Location(NamedTuple):
    """A place in words, and what it moves with: "car", "engine", or "" for a part of its own."""

    name: str
    moves_with: str = ""
    near: bool = True  # False: deforms in the crash, so that it bears witness of the body but is not the body


SEEN = {
    "HDCG": Location("head"),
    "NEKU": Location("neck_upper"),
    "CHST": Location("chest"),
    "PVCN": Location("pelvis"),
    "FMRL": Location("left_femur"),
    "FMRR": Location("right_femur"),
    "TBLU": Location("left_upper_tibia"),
    "TBLL": Location("left_lower_tibia"),
    "TBRU": Location("right_upper_tibia"),
    "TBRL": Location("right_lower_tibia"),
    "FTLF": Location("left_foot_front"),
    "FTLR": Location("left_foot_rear"),
    "FTRF": Location("right_foot_front"),
    "FTRR": Location("right_foot_rear"),
    "SHBT": Location("shoulder_belt"),
    "LPBO": Location("lap_belt_outboard"),
    "FLLR": Location("floor_left_rear", "car"),
    "FLRR": Location("floor_right_rear", "car"),
    "ENGN": Location("engine", "engine"),
}
READ = {
    "NEKL": Location("neck_lower"),
    "SPNU": Location("spine_upper"),
    "SPNL": Location("spine_lower"),
    "LPBI": Location("lap_belt_inboard"),
    "VECG": Location("cg", "car"),
    "VEHC": Location("vehicle", "car"),
    "FLCF": Location("floor_center_front", "car"),
    "FLCR": Location("floor_center_rear", "car"),
    "FLLF": Location("floor_left_front", "car"),
    "FLRF": Location("floor_right_front", "car"),
    "SILL": Location("left_sill", "car"),
    "SILR": Location("right_sill", "car"),
    "TOEL": Location("left_toepan", "car", near=False),
    "TOER": Location("right_toepan", "car", near=False),
    "BRCL": Location("left_brake_caliper"),
    "BRCR": Location("right_brake_caliper"),
    "DPLC": Location("dashpanel_center"),
    "DPLL": Location("dashpanel_left"),
    "DPLR": Location("dashpanel_right"),
    "STCL": Location("steering_column"),
}
LOCATIONS = SEEN | READ

FAMILIES = (
    ("FL", Location("floor", "car")),
    ("VECG", Location("cg", "car")),
    ("VEHC", Location("vehicle", "car")),
    ("SIL", Location("sill", "car")),
    ("TOE", Location("toepan", "car", near=False)),
    ("ENGN", Location("engine", "engine")),
)
"""What the beginning of a code says where the whole is not known."""
WORDS = (
    ("TOEPAN", FAMILIES[4][1]),
    ("TOE PAN", FAMILIES[4][1]),
    ("SILL", FAMILIES[3][1]),
    ("FLOORPAN", FAMILIES[0][1]),
    ("SEAT CROSSMEMBER", FAMILIES[0][1]),
)
"""What a comment says where the code does not."""

OCCUPANTS = {"01": "driver", "02": "passenger"}


def location_of(code: str, comment: str) -> Location:
    """Where a sensor is, by its code and, for what it moves with, by its comment."""
    if code in LOCATIONS:
        return LOCATIONS[code]
    named = code.lower().replace(" ", "_") or "unknown"
    for part, family in FAMILIES:
        if code.startswith(part):
            return family._replace(name=named)
    told = next((known for word, known in WORDS if word in comment.upper()), Location(named))
    return told._replace(name=named)


def occupant_of(code: str) -> str:
    """Who carries the sensor: driver, passenger, occupant03, ... or "" for nobody."""
    if code in OCCUPANTS:
        return OCCUPANTS[code]
    return f"occupant{code}" if code.isdigit() and int(code) else ""
