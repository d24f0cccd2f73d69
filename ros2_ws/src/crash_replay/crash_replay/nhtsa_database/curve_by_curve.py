"""A test whose package is missing: its header from the database's answers, its curves one by one, in EV5 form."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .. import limits
from ..output import write_text
from ..progress import with_progress
from ..readers.ev5 import Curve
from ..recording import RecordingError
from .polite_client import Missing, PoliteClient

TEST = (
    "TITLE", "TSTOBJ", "TSTDAT", "TSTPRF", "CONNO", "TSTREF", "TSTTYP", "TSTCFN", "TKSURF", "TKCOND", "TEMP", "RECTYP",
    "LINK", "CLSSPD", "IMPANG", "OFFSET", "IMPPNT", "TOTCRV", "TSTCOM",
)  # fmt: skip
INSTRUMENTATION = (
    "VEHNO", "CURNO", "SENTYP", "SENLOC", "SENATT", "AXIS", "XUNITS", "YUNITS", "PREFIL", "INSMAN", "CALDAT", "INSRAT",
    "CHLMAX", "INIVEL", "NFP", "NLP", "DELT", "DASTAT", "CHSTAT", "INSCOM",
)  # fmt: skip
"""Columns of EV5, in their order: those of `Curve`."""
DETAILS = {
    "CURNO": "curveNo",
    "SENTYP": "sensorType",
    "SENLOC": "sensorLocation",
    "SENATT": "sensorAttachment",
    "AXIS": "axisDirofSensor",
    "YUNITS": "dataMeasurementUnits",
    "CHSTAT": "channelStatus",
    "DASTAT": "dataStatus",
    "NFP": "numberofFirstPoint",
    "NLP": "numberofLastPoint",
    "DELT": "timeIncrement",
    "INSCOM": "instrumentationCommentary",
}
"""The same as the instrumentation's own answers call them, for tests whose metadata lack it."""
NUMBERS = ("VEHNO", "CURNO", "INIVEL", "NFP", "NLP", "DELT", "CLSSPD")
VEHICLE_FIELDS, VEHICLE_MASS = 12, 10
assert len(INSTRUMENTATION) == len(Curve._fields)


def assemble(client: PoliteClient, number: int, folder: Path) -> None:
    """Header and curves into a folder that exists; curves that an earlier attempt has left there are not asked again.

    Raises RecordingError (Unreachable where the server is silent) where there is no such test or no curve of it.
    """
    metadata = _metadata(client, number)
    rows: Sequence[Mapping[str, Any]] = [
        row for row in metadata.get("INSTRUMENTATION") or () if isinstance(row, Mapping)
    ]
    rows = rows or _instrumentation(client, number)
    if not rows:
        raise RecordingError(f"nhtsa:{number}: the database has neither a package nor curves of this test")
    header = _header(number, metadata, rows)
    found = 0
    for row in with_progress(rows, f"nhtsa:{number}: curve"):
        curve = int(_number(row, "CURNO"))
        file = folder / f"v{number:05d}.{curve:03d}"
        if not file.exists():
            try:
                text = client.curve(number, curve)
            except Missing:
                continue
            write_text(file, _two_columns(text, row, f"nhtsa:{number}: curve {curve}"))
        found += 1
    if not found:
        raise RecordingError(f"nhtsa:{number}: the database has neither a package nor curves of this test")
    write_text(folder / f"v{number:05d}.EV5", header)


def _metadata(client: PoliteClient, number: int) -> Mapping[str, Any]:
    try:
        results = client.answer(f"vehicle-database-test-results/metadata/{number}")
    except Missing:
        results = None
    content = results[0] if isinstance(results, list) and results else results
    if not isinstance(content, Mapping) or not any(content.values()):
        raise RecordingError(f"nhtsa:{number}: NHTSA's database has no vehicle test of this number")
    return content


def _instrumentation(client: PoliteClient, number: int) -> list[dict[str, Any]]:
    """A row for each curve, from the answers of which each tells of one."""
    base = "vehicle-database-test-results"
    listed = client.answer(
        f"{base}/get-instrumentation-info/{number}?count=999&pageNumber=0&orderBy=curveNo&sortBy=ASC"
    )
    rows = []
    for short in with_progress(listed if isinstance(listed, list) else [], f"nhtsa:{number}: about curve"):
        curve = int(_number({"CURNO": short.get("curveNo")}, "CURNO"))
        told = client.answer(f"{base}/get-instrumentation-detail-info/{curve}/{number}")
        detail = told[0] if isinstance(told, list) and told else told
        both = dict(short) | (dict(detail) if isinstance(detail, Mapping) else {})
        rows.append({ours: both.get(theirs) for ours, theirs in DETAILS.items()} | {"VEHNO": both.get("vehicleNo", 1)})
    return rows


def _header(number: int, metadata: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> str:
    tests = metadata.get("TEST")
    test = tests[0] if isinstance(tests, list) and tests else tests if isinstance(tests, Mapping) else {}
    lines = [f"# Source: NHTSA Vehicle Database - Test Number: {number}", "----- EV5 -----", "----- TEST -----"]
    lines.append("|".join(["V5", *(_field(test, key) for key in TEST)]))
    lines.append("----- VEHICLE -----")
    for vehicle in metadata.get("VEHICLE") or ():
        if isinstance(vehicle, Mapping):
            fields = [_field(vehicle, "VEHNO"), *[""] * (VEHICLE_FIELDS - 1)]
            fields[VEHICLE_MASS] = f"{_number(vehicle, 'VEHTWT'):g}"
            lines.append("|".join(fields))
    lines.append("----- INSTRUMENTATION -----")
    lines += ["|".join(_field(row, key) for key in INSTRUMENTATION) for row in rows]
    return "\n".join([*lines, "----- END -----", ""])


def _field(row: Mapping[str, Any], key: str) -> str:
    if key in NUMBERS:
        return f"{_number(row, key):.10g}"
    value = row.get(key)
    text = "" if value is None else " ".join(str(value).replace("|", "/").split())
    return text[: int(limits.TEXT.highest)]


def _number(row: Mapping[str, Any], key: str) -> float:
    """Numbers come as such, as text or as N/A."""
    try:
        value = float(row.get(key) or 0.0)
    except (TypeError, ValueError):
        return 0.0
    return value if abs(value) < 1e12 else 0.0


def _two_columns(text: bytes, row: Mapping[str, Any], what: str) -> str:
    """Time in s and value; the time made of the header's where the file has none, or the same in every line."""
    try:
        lines = [line for line in text.decode("latin-1").splitlines() if line.strip()]
        table = np.loadtxt(lines, ndmin=2)
    except ValueError as error:
        raise RecordingError(f"{what}: expected columns of numbers: {limits.shown(str(error))}") from None
    if table.shape[1:] not in ((1,), (2,)) or not len(table):
        raise RecordingError(f"{what}: expected one or two columns, found {table.shape[1:] or 'none'}")
    times: np.ndarray = table[:, 0] if table.shape[1] == 2 else np.zeros(len(table))
    if len(times) < 2 or np.ptp(times) == 0.0:
        times = (_number(row, "NFP") + np.arange(len(table))) * _number(row, "DELT") * 1e-6
    return "".join(f"{t:.9g}\t{v:.9g}\n" for t, v in zip(times, table[:, -1]))
