"""NHTSA crash test folder in UDS form: a file for each curve, which says of the test what it needs.

What is made of the curves is that of an EV5 folder (`nhtsa`). A UDS file has the sensor's attachment in the code
library's words, no date, and nothing of a sensor that was not fitted.
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..recording import Recording, RecordingError
from ..shortened import shortened
from .codes.nhtsa import code_of_attachment, code_of_status
from .ev5 import Curve, Header
from .left_out import MARK
from .nhtsa import recording_of
from .nhtsa_curves import Unusable, read_tracks
from .uds import UdsCurve, is_uds, read_uds
from .units import KMH, POUND_MASS, si_factor

UNITS = {
    "NEWTONS": "NWT", "NEWTON-METERS": "NWM", "MILLIMETERS": "MM", "METERS": "m", "INCHES": "in", "POUNDS": "lbf",
    "POUND-FEET": "LBF", "KILOMETERS/HOUR": "KPH", "METERS/SEC": "m/s", "MILES/HOUR": "mph", "METERS/SEC**2": "m/s^2",
    "DEGREES/SEC": "DPS", "RADIANS/SEC": "rad/s",
}  # fmt: skip
"""UDS's units that a channel can have; G'S is as it stands."""
SYSTEMS = {"MET": ("KPH", 1.0), "SI": ("m/s", 1.0), "ENG": ("mph", POUND_MASS)}
"""Unit of a velocity, and kg per unit of mass, in each DIMSYS."""
SENSORS = {"ACCELERATION": "AC", "FORCE": "LC", "TORQUE": "LC", "DISPLACEMENT": "DS", "VELOCITY": "VL"}


def found(path: Path) -> bool:
    return path.is_dir() and bool(_files(path))


def _files(folder: Path) -> list[Path]:
    named = (file for file in folder.iterdir() if file.suffix.lower() == ".uds" or file.suffix[1:].isdigit())
    return sorted(file for file in named if is_uds(file))


def read(path: Path, cells: bool = False, all_sensors: bool = False) -> Recording:
    """As `nhtsa.read`. A file at fault costs only itself; one of another test is an error."""
    read_curves, wrong = [], []
    for file in _files(path):
        try:
            read_curves += [(file, curve) for curve in read_uds(file)]
        except (RecordingError, OSError) as error:
            wrong.append(f"{MARK}{file.name}: {str(error).removeprefix(f'{file}:').strip()}")
    if not read_curves:
        raise RecordingError(f"{path}: no UDS file can be used: {shortened(wrong)}")
    tests = {curve.test["TSTNO"] for _, curve in read_curves}
    if len(tests) > 1:
        raise RecordingError(f"{path}: expected the curves of one test, found {', '.join(map(str, sorted(tests)))}")
    read_curves.sort(key=lambda pair: pair[1].fields["CURNO"])
    header = _header(path, [curve for _, curve in read_curves])

    def samples_of(k: int) -> tuple[str, np.ndarray]:
        file, curve = read_curves[k]
        if curve.fields["XTYP"] not in ("TIME", ""):
            raise Unusable(f"it is over {curve.fields['XTYP'].lower()}, not over time")
        n = len(curve.y)
        x = curve.x if curve.x is not None else (curve.fields["NFP"] + np.arange(n)) * (header.curves[k].step * 1e-6)
        return file.name, np.column_stack([x, curve.y])

    tracks, left_out = read_tracks(header, samples_of)
    if not tracks:
        reasons = dict.fromkeys([*(why for _, why in left_out), *wrong])
        raise RecordingError(f"{path}: none of the {len(read_curves)} curves can be used: {shortened(list(reasons))}")
    recording = recording_of(path, header, tracks, left_out, cells, all_sensors)
    return replace(recording, test=replace(recording.test, notes=(*recording.test.notes, *wrong)))


def _header(path: Path, curves: list[UdsCurve]) -> Header:
    test = curves[0].test
    masses = {
        curve.test["CMPNO"]: float(f"{curve.test['CMPWGT'] * _system(path, curve)[1]:.6g}")
        for curve in curves
        if curve.test["CMPNO"] > 0 and curve.test["CMPTYP"] in ("VE", "ID", "IR", "")
    }
    return Header(
        number=str(test["TSTNO"] or test["TSTNAM"] or path.name),
        title=test["TITLE"],
        date="",
        laboratory=test["TSTPRF"],
        configuration=test["TSTCFN"],
        closing_speed=_kmh(path, curves[0], test["CLSSPD"]),
        impact_angle=float(test["IMPANG"]),
        masses=masses,
        curves=tuple(_curve(path, curve) for curve in curves),
    )


def _curve(path: Path, curve: UdsCurve) -> Curve:
    """The record that an EV5 header has of it; no redundancy, no rating."""
    fields = curve.fields
    step = float(f"{_step(curve) * 1e6:.6g}")  # a single has seven figures
    return Curve(
        vehicle=curve.test["CMPNO"], number=fields["CURNO"], sensor=SENSORS.get(fields["YTYP"], ""),
        occupant=fields["SENLOC"] or "NA", location=code_of_attachment(fields["SENATT"]), axis=fields["AXIS"],
        time_unit="SEC", unit=UNITS.get(fields["YUNITS"], fields["YUNITS"]), prefilter=f"{fields['PREF']:g}", maker="",
        calibration="", full_scale="", full_scale_used="", initial_velocity=_kmh(path, curve, fields["INIVEL"]),
        first=fields["NFP"], last=fields["NLP"], step=step, status=code_of_status(fields["STATUS"]), redundancy="",
        comment=fields["CURDSC"],
    )  # fmt: skip


def _step(curve: UdsCurve) -> float:
    """s"""
    if curve.x is not None and len(curve.x) > 1 and np.isfinite(curve.x).all():
        return float(curve.x[-1] - curve.x[0]) / (len(curve.x) - 1)
    return curve.fields["DEL"]


def _kmh(path: Path, curve: UdsCurve, value: float) -> float:
    speed = value * si_factor("velocity", _system(path, curve)[0]) / KMH
    return float(f"{speed:.6g}") if math.isfinite(speed) else 0.0


def _system(path: Path, curve: UdsCurve) -> tuple[str, float]:
    name = curve.test["DIMSYS"]
    if name not in SYSTEMS:
        raise RecordingError(f"{path}: expected DIMSYS {', '.join(SYSTEMS)}, found {name!r}")
    return SYSTEMS[name]
