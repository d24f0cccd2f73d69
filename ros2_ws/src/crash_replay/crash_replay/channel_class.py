"""The channel frequency class of a channel, as SAE J211-1 (table 1) gives it by what the sensor measures and where.

A head is filtered with CFC 1000, a spine with 180, the motion of a vehicle with 60: one class for all would take the
peaks from the heads, or leave the ringing of a floor panel in the car's motion.
"""

import re
from typing import NamedTuple

from .recording import Channel

BY_CLASS = "class"
"""In place of a number: each channel its own."""


class ChannelClass(NamedTuple):
    cfc: int
    what: str  # the table's row


class _Row(NamedTuple):
    words: str  # of the channel's name or body, as a regular expression
    quantities: tuple[str, ...]
    found: ChannelClass


def _row(words: str, quantities: str, cfc: int, what: str) -> _Row:
    return _Row(rf"(^|_)({words})(_|\d|$)", tuple(quantities.split()), ChannelClass(cfc, what))


BARRIER = ChannelClass(60, "barrier force")
LEG = "femur|knee|tibia|ankle|leg"
ROWS = (
    _row("head", "acceleration angular_velocity", 1000, "head acceleration"),
    _row("neck", "force", 1000, "neck force"),
    _row("neck", "moment", 600, "neck moment"),
    _row("rib|ribs|sternum", "acceleration", 1000, "rib or sternum acceleration"),
    _row("spine|chest|thorax", "acceleration", 180, "spine acceleration"),
    _row("rib|ribs|sternum|chest|thorax", "displacement", 600, "chest deflection"),
    _row("lumbar|lumbar_spine", "force moment", 1000, "lumbar load"),
    _row("pelvis", "acceleration force moment", 1000, "pelvis"),
    _row(LEG, "force moment", 600, "leg load"),
    _row(LEG, "displacement", 180, "leg displacement"),
    _row("belt|lap_belt|shoulder_belt", "force", 60, "belt force"),
    _row("barrier|mdb", "force moment", BARRIER.cfc, BARRIER.what),
    _row("steering_column|steering_wheel", "force moment", 600, "steering column load"),
)
PART_OF_A_VEHICLE = re.compile(
    r"(^|_)([abcd]_pillar|sill|door|door_panel|floor|floorpan|toepan|tunnel|crossmember|seat_cross_member|roof|roof_rail"
    r"|firewall|bumper|trunk_floor|rear_deck|engine|car)(_|$)"
)
"""Also beside a seat: the b-pillar at the driver's is no dummy's."""
DUMMY = re.compile(
    r"(^|_)(driver|passenger|occupant\d*|(front|second|third)_(left|middle|right)|seat_[a-z]|foot|abdomen)(_|$)"
)
OTHER_OF_A_DUMMY = ChannelClass(1000, "dummy, no row of its own: the widest class")
VEHICLE = ChannelClass(60, "vehicle structure, for comparison and simulation")


def class_of(channel: Channel) -> ChannelClass:
    """By the first row that fits; a vehicle's part where none does."""
    said = f"{channel.name}_{channel.body}"
    for row in ROWS:
        if channel.quantity in row.quantities and re.search(row.words, said):
            return row.found
    return OTHER_OF_A_DUMMY if DUMMY.search(said) and not PART_OF_A_VEHICLE.search(said) else VEHICLE


def takes_part_in_the_impact(channel: Channel) -> bool:
    """It is of a vehicle's structure or of the barrier: no dummy's, no belt's, whose load follows."""
    return class_of(channel) in (VEHICLE, BARRIER)


def frequency_class(text: str) -> int | str:
    """On a command line: a number, or `class`."""
    return int(text) if text.isdigit() else text
