"""Readable names for NHTSA's curves, from the codes and the comment of the header.

    DRIVER HEAD X                      -> driver_head_ax             on driver_head
    LEFT REAR SEAT CROSSMEMBER XR      -> left_rear_crossmember_ax_redundant    on car
    TOP OF ENGINE X                    -> engine_top_ax              on engine
    BARRIER K-01 Fx                    -> barrier_k01_fx             on barrier

The place is the comment without what the codes say better: the quantity and axis, which follow as
a letter each (a, v, d, f, m, w for angular velocity; x, y, z). Where the comment says nothing (NO COMMENTS), the place
is that of the location code:

    01, HDCG, NO COMMENTS, XL          -> driver_head_ax             on driver_head
    FLLR, NO COMMENTS, XG              -> floor_left_rear_ax         on car
"""

import re
from collections import Counter
from collections.abc import Sequence

from .codes.nhtsa import location_of, occupant_of
from .ev5 import Curve
from .units import quantity_of

LETTER = {
    "acceleration": "a",
    "velocity": "v",
    "displacement": "d",
    "force": "f",
    "moment": "m",
    "angular_velocity": "w",
}
NOTHING = re.compile(r"(NO|NONE|NOT|N/?A|UNKNOWN)?\W*(COMMENTS?|COMMENTARY|APPLICABLE)?\W*")
"""A comment that says nothing: NO COMMENTS, NONE, N/A."""
NOR_DOES = re.compile(
    r"ACCEL(EROMETER)?\.? LOCATION *#? *\d+|\b(NO|NOT) (COMMENTS?|APPLICABLE)|(CURVE|CHANNEL) *#? *\d+\b"
    r"|[^;,]*\b(DATA|FULL SCALE)\b[^;,]*"
)
"""Parts of a comment that name no place: ACCEL. LOCATION #1, NO COMMENTS stands in the headers of side impacts; and
what is said of the data, as EXCEEDED FULL SCALE AT 61.4 MS, QUESTIONABLE DATA THEREAFTER."""
SAID_BY_CODES = re.compile(
    r"\b([FMA]?[XYZ]R?|RED|REDUNDANT|PRIMARY|ACCELERATION|ANGULAR|VELOCITY|DISPLACEMENT|DEFLECTION"
    r"|FORCE|MOMENT|LOAD|CELL)\b"
)
SHORTER = {"SEAT CROSSMEMBER": "CROSSMEMBER"}


def axis_of(curve: Curve) -> str:
    """x, y, z, or "" where the header has none (NA, resultants)."""
    first = curve.axis[:1].lower()
    return first if first in ("x", "y", "z") else ""


def place(curve: Curve) -> str:
    """Where the sensor is, as a part of a name."""
    text = NOR_DOES.sub(" ", curve.comment.split(":")[0].upper()).strip()
    if NOTHING.fullmatch(text):
        named = location_of(curve.location, "").name
        owner = "barrier" if curve.vehicle == 0 else occupant_of(curve.occupant)
        return "_".join(filter(None, [owner, *re.findall(r"[a-z0-9]+", named)]))
    for long, short in SHORTER.items():
        text = text.replace(long, short)
    text = re.sub(r"\b([A-Z])-(\d+)", r"\1\2", text)  # a cell of the barrier: K-01
    text = SAID_BY_CODES.sub(" ", text)
    part, _, whole = text.partition(" OF ")
    words = re.findall(r"[A-Z0-9]+", f"{whole} {part}" if whole else part) or [curve.location]
    occupant = occupant_of(curve.occupant).upper()
    if occupant and occupant not in words:
        words.insert(0, occupant)
    if words[0][0].isdigit():
        words.insert(0, curve.location)
    return "_".join(words).lower()


def body_of(curve: Curve, vehicles: int) -> str:
    """The body that carries the sensor: barrier, car, engine, or the place itself (driver_head, ...)."""
    if curve.vehicle == 0:
        return "barrier"
    of_vehicle = f"vehicle{curve.vehicle}_" if vehicles > 1 else ""
    if occupant_of(curve.occupant):
        return of_vehicle + place(curve)
    return of_vehicle + (location_of(curve.location, curve.comment).moves_with or place(curve))


def channel_names(curves: Sequence[Curve], vehicles: int) -> list[str]:
    """A name for each curve; where a second curve would have the same, it gets `_2` and so on."""
    names, taken = [], Counter()
    for curve in curves:
        of_vehicle = f"vehicle{curve.vehicle}_" if vehicles > 1 and curve.vehicle else ""
        letter = LETTER.get(quantity_of(curve.unit) or "", "")
        name = f"{of_vehicle}{place(curve)}_{letter}{axis_of(curve)}".rstrip("_")
        if curve.redundancy == "R":
            name += "_redundant"
        taken[name] += 1
        names.append(name if taken[name] == 1 else f"{name}_{taken[name]}")
    return names
