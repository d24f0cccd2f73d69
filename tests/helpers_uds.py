"""UDS folders made by hand from the records of `helpers_ev5`: a file for each curve, as UDS_File.txt describes it."""

import struct

import numpy as np
from helpers_ev5 import MASSES, TIME

from crash_replay.readers.codes.nhtsa_library import DATA_STATUS, SENSOR_ATTACHMENTS

WORDS = {"G'S": ("ACCELERATION", "G'S"), "MM": ("DISPLACEMENT", "MILLIMETERS")}

CODES = {"SILL": "DSLF", "SILR": "DSRF", "TOEL": "FLTU"}
"""Of the records that a UDS file cannot have, because the library has no words for them, ones that it has."""


def write_uds(folder, records, number=7292, form="IEEE", xy=False):
    """The folder, its numbers in one of UDS's three forms."""
    folder.mkdir(exist_ok=True)
    for record, values in records:
        made = uds_file(record.split("|"), values, number, form, xy)
        (folder / f"v{number:05d}aa0.{int(record.split('|')[1]):03d}.uds").write_bytes(made)
    return folder


def uds_file(fields, values, number, form, xy=False):
    vehicle = int(fields[0])
    quantity, unit = WORDS[fields[7]]
    letters = "X-Y" if xy else "Y"
    header = [
        ("UDS-1992", 12), 1, (letters, 10), (form, 5), ("MET", 3), ("VEHICLE DB", 15), number,
        (str(number).rjust(12), 12),
        ("TWO CARS HEAD ON", 70), ("LAB", 25), ("R", 10), ("VTV", 3), 0, 90.0, vehicle, ("VE", 2), ("", 30), ("", 15),
        ("", 25), 2012, ("", 25), ("", 4), MASSES[vehicle], float(fields[13]),
    ]  # fmt: skip
    curve = [
        ("CURVE HDR", 12), 1, (letters, 10), int(fields[1]), (fields[1].rjust(12), 12),
        (SENSOR_ATTACHMENTS.get(fields[4], fields[4]), 30), (fields[3], 2), 0, 0, 0, (fields[5], 2), (quantity, 20),
        (unit, 20),
        ("TIME", 20), ("SECONDS", 20), (DATA_STATUS[fields[17]], 20), ("TIME SERIES", 20), ("", 70), int(fields[14]),
        int(fields[14]) + len(values) - 1, 0.0 if xy else float(fields[16]) * 1e-6, float(fields[13]), 3000.0,
    ]  # fmt: skip
    second = [("CMP-2 HDR", 12)]
    parts = [packed(part, form).ljust(512, b"\0") for part in (header, second, curve)]
    for mark, numbers in (("Y DATA", values), ("X DATA", TIME[: len(values)] if xy else [])):
        for k in range(0, len(numbers), 125):
            raw = b"".join(number_of(x, form) for x in numbers[k : k + 125])
            parts.append(mark.ljust(12).encode() + raw.ljust(500, b"\0"))
    return b"".join(parts)


def packed(fields, form):
    made = b""
    for field in fields:
        if isinstance(field, tuple):
            made += field[0][: field[1]].ljust(field[1]).encode()
        elif isinstance(field, int):
            made += struct.pack(">i" if form == "SUN" else "<i", field)
        else:
            made += number_of(field, form)
    return made


def number_of(value, form):
    if form != "VAX":
        return struct.pack(">f" if form == "SUN" else "<f", value)
    (bits,) = struct.unpack("<I", struct.pack("<f", np.float32(value) * np.float32(4.0)))
    return struct.pack("<HH", bits >> 16, bits & 0xFFFF)
