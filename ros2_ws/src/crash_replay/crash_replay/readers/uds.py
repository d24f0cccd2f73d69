"""A curve file in NHTSA's UDS-1992 form, as its public tools describe it (NHTSA-Tools, UDS_File.txt, UDS_Vars.txt).

Records of 512 bytes, each with 12 letters that say what it is: the header (UDS-1992), a second component's (CMP-2 HDR),
and for each channel its own (CURVE HDR) and 125 single floats a record of Y DATA, of X DATA where the form is X-Y.
Numbers are in the form that the header names: IEEE or VAX, both little-endian, or SUN.
"""

import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .. import limits
from ..recording import RecordingError

MARK = b"UDS-1992    "
RECORD, MARKED = 512, 12
PER_RECORD = (RECORD - MARKED) // 4
HEADER = (
    "FILEVER*12 NCHAN=i FILEFORM*10 NUMFORM*5 DIMSYS*3 TSTSRC*15 TSTNO=i TSTNAM*12 TITLE*70 TSTPRF*25 TSTREF*10 "
    "TSTCFN*3 IMPANG=i CLSSPD=f CMPNO=i CMPTYP*2 CMPDSC*30 MAKE*15 MODEL*25 YEAR=i BODY*25 ENGINE*4 CMPWGT=f CMPSPD=f"
)
CURVE = (
    "MARK*12 ICHAN=i CHANFORM*10 CURNO=i CURNAM*12 SENATT*30 SENLOC*2 SENNUM=i BANDNO=i GAGNO=i AXIS*2 YTYP*20 "
    "YUNITS*20 XTYP*20 XUNITS*20 STATUS*20 CURTYP*20 CURDSC*70 NFP=i NLP=i DEL=f INIVEL=f PREF=f"
)
"""Fields of the records, as far as they are used: * letters, =i a whole number, =f a float."""
BYTE_ORDER = {"IEEE": "<", "VAX": "<", "SUN": ">"}


class UdsCurve(NamedTuple):
    """One channel of a file, in the file's own units."""

    test: Mapping[str, Any]  # fields of HEADER
    fields: Mapping[str, Any]  # fields of CURVE
    x: np.ndarray | None  # (n,), None where it is (NFP + k) DEL
    y: np.ndarray  # (n,)


def is_uds(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            return file.read(len(MARK)) == MARK
    except OSError:
        return False


def read_uds(path: Path) -> list[UdsCurve]:
    """The channels of a file. Raises RecordingError with file and what was expected."""
    if wrong := limits.file_wrong(path, limits.CURVE_FILE):
        raise RecordingError(f"{path}: {wrong}")
    data = path.read_bytes()
    if not data.startswith(MARK):
        raise RecordingError(f"{path}: expected {MARK.decode().strip()!r} at its beginning")
    form = data[26:31].decode("latin-1").strip(" \0")
    if form not in BYTE_ORDER or len(data) < 2 * RECORD:
        what = f"NUMFORM IEEE, VAX or SUN, found {form!r}" if form not in BYTE_ORDER else "a header and a curve's"
        raise RecordingError(f"{path}: expected {what}")
    test = _fields(HEADER, data[:RECORD], form)
    curves = list(_curves(path, data, test, form))
    if not curves:
        raise RecordingError(f"{path}: it has no record CURVE HDR")
    return curves


def _curves(path: Path, data: bytes, test: Mapping[str, Any], form: str) -> Iterator[UdsCurve]:
    at = RECORD
    while at < len(data):
        if data[at : at + MARKED].strip() != b"CURVE HDR":
            at += RECORD
            continue
        fields = _fields(CURVE, data[at : at + RECORD].ljust(RECORD), form)
        count = fields["NLP"] - fields["NFP"] + 1
        if count < 1 or limits.SAMPLES.wrong(count) or limits.SAMPLES.wrong(abs(fields["NFP"])):
            raise RecordingError(f"{path}: NFP {fields['NFP']} and NLP {fields['NLP']} span no curve")
        at += RECORD
        read = {}
        for what in ("Y DATA", "X DATA")[: 2 if fields["CHANFORM"] == "X-Y" else 1]:
            read[data[at : at + MARKED].strip().decode("latin-1") or what] = _numbers(path, data, at, count, form)
            at += RECORD * -(-count // PER_RECORD)
        wanted = {"Y DATA", "X DATA"} if fields["CHANFORM"] == "X-Y" else {"Y DATA"}
        if set(read) != wanted:
            raise RecordingError(f"{path}: expected records {', '.join(sorted(wanted))}, found {', '.join(read)}")
        yield UdsCurve(test, fields, read.get("X DATA"), read["Y DATA"])


def _numbers(path: Path, data: bytes, at: int, count: int, form: str) -> np.ndarray:
    """(count,) of records one after the other from `at`."""
    records = -(-count // PER_RECORD)
    mark = data[at : at + MARKED]
    parts = []
    for record in range(at, at + records * RECORD, RECORD):
        if data[record : record + MARKED] != mark:
            raise RecordingError(f"{path}: {count} samples are stated, {len(parts) * PER_RECORD} are there")
        parts.append(data[record + MARKED : record + RECORD])
    raw = b"".join(parts)[: 4 * count]
    if len(raw) < 4 * count:
        raise RecordingError(f"{path}: {count} samples are stated, {len(raw) // 4} are there")
    return _floats(raw, form)


def _floats(raw: bytes, form: str) -> np.ndarray:
    """Singles. VAX: words swapped, and 4 times the IEEE single of the same bits; exponent 0 is zero."""
    if form != "VAX":
        with np.errstate(invalid="ignore"):  # a signalling NaN is one like any other
            return np.frombuffer(raw, dtype=f"{BYTE_ORDER[form]}f4").astype(float)
    words = np.frombuffer(raw, dtype="<u2").reshape(-1, 2)
    bits = (words[:, 0].astype(np.uint32) << 16) | words[:, 1]
    exponent = (bits >> 23) & 0xFF
    value = np.ldexp(0.5 * (1.0 + (bits & 0x7FFFFF) / 2.0**23), exponent.astype(int) - 128)
    return np.where(exponent == 0, 0.0, np.where(bits >> 31, -value, value))


def _fields(layout: str, record: bytes, form: str) -> dict[str, Any]:
    found: dict[str, Any] = {}
    at = 0
    for field in layout.split():
        name, kind, size = field.partition("*") if "*" in field else field.partition("=")
        if kind == "*":
            found[name] = record[at : at + int(size)].decode("latin-1").strip(" \0")
            at += int(size)
            continue
        raw = record[at : at + 4]
        found[name] = struct.unpack(f"{BYTE_ORDER[form]}i", raw)[0] if size == "i" else float(_floats(raw, form)[0])
        at += 4
    return found
