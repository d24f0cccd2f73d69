"""The curves of an NHTSA test: which can be used, and why the others cannot; those of an EV5 folder."""

import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .. import limits
from ..progress import with_progress
from ..recording import Channel
from .codes.nhtsa import INVALID
from .ev5 import Curve, Header
from .nhtsa_names import axis_of, body_of, channel_names
from .units import quantity_of, si_factor

VALID_UNTIL = re.compile(r"no valid data after (\d+(?:\.\d+)?) *m(?:s|(?:illi?)?-?sec)", re.IGNORECASE)
"""In ms; one laboratory writes MILLISECONDS, and MILLSECONDS."""
ON_GRID = 0.01
"""Share of the sample period by which a file's times may be off the header's."""


class Track(NamedTuple):
    """A curve that can be used: SI values at the indices first, first + 1, ... (index 0 is time zero)."""

    curve: Curve
    channel: Channel
    first: int
    values: np.ndarray

    @property
    def end(self) -> int:
        return self.first + len(self.values)

    def on(self, start: int, end: int) -> np.ndarray:
        """(end - start,) values at the indices from start, NaN where there is none."""
        column = np.full(end - start, np.nan)
        column[self.first - start : self.end - start] = self.values
        return column


LeftOut = list[tuple[Curve, str]]


class Unusable(Exception):
    """Why a curve is left out."""


def read_tracks(header: Header, samples_of: Callable[[int], tuple[str, np.ndarray]]) -> tuple[list[Track], LeftOut]:
    """The usable curves, and the others with the reason why they are not.

    samples_of: of the header's k-th curve its file's name and (n, 2) time in s and value; raises Unusable.
    """
    tracks, left_out = [], []
    vehicles = header.vehicles
    named = list(zip(header.curves, channel_names(header.curves, vehicles)))
    for k, (curve, name) in enumerate(with_progress(named, "reading curve")):
        try:
            tracks.append(_read_track(curve, name, body_of(curve, vehicles), partial(samples_of, k)))
        except Unusable as why:
            left_out.append((curve, str(why)))
    return tracks, left_out


def ev5_samples(header_file: Path, header: Header) -> Callable[[int], tuple[str, np.ndarray]]:
    """Of a folder with a file for each curve beside the header: values alone, as laboratories submit them, or beside
    their time, as the database gives them out."""

    def samples_of(k: int) -> tuple[str, np.ndarray]:
        curve = header.curves[k]
        file = header_file.with_name(f"{header_file.stem}.{curve.number:03d}")
        if not file.is_file():
            raise Unusable("no data file")
        table = _table(file)
        if table.shape[1] == 1:
            stated = curve.last - curve.first + 1
            if len(table) != stated:
                raise Unusable(f"{file.name}: {len(table)} values, {stated} in the header, and no times beside them")
            times = (curve.first + np.arange(stated)) * (curve.step * 1e-6)
            table = np.column_stack([times, table])
        return file.name, table

    return samples_of


def _read_track(curve: Curve, name: str, body: str, samples: Callable[[], tuple[str, np.ndarray]]) -> Track:
    until = VALID_UNTIL.search(curve.comment)
    if curve.status == "NO":
        raise Unusable("sensor not fitted")
    if curve.status in INVALID and not until:
        raise Unusable("no valid data, says the header")
    quantity = quantity_of(curve.unit)
    if quantity is None:
        raise Unusable(f"unit {curve.unit} has no ROS message")
    if limits.PERIOD.wrong(curve.step * 1e-6):
        raise Unusable(f"its step of {curve.step:g} us is none")
    file, table = samples()
    if wrong := limits.times_wrong(table[:, 0]):
        raise Unusable(f"{file}: {wrong}")
    index = table[:, 0] / (curve.step * 1e-6)
    first = round(index[0])
    if np.any(np.abs(index - first - np.arange(len(index))) > ON_GRID):
        raise Unusable(f"{file}: its times are not the header's steps of {curve.step:g} us")
    values = limits.valid_values(table[:, 1], si_factor(quantity, curve.unit))
    if until:
        ends = min(float(until[1]), limits.TIME.highest * 1e3)  # ms
        values = values[: max(0, round(ends * 1e3 / curve.step) - first)]
    source = f"{file}: {curve.comment.split(':')[0]}, {curve.unit}, prefilter {curve.prefilter} Hz"
    return Track(curve, Channel(name, quantity, body, axis_of(curve), source), first, values)


def _table(file: Path) -> np.ndarray:
    """(n, 2) time in s and value, or (n, 1) the values alone. Raises Unusable."""
    try:
        if wrong := limits.file_wrong(file, limits.CURVE_FILE):
            raise Unusable(f"{file.name} {wrong}")
        lines = file.read_text(encoding="latin-1").upper().replace("D", "E").splitlines()  # Fortran's 0.5D-01
        table = np.loadtxt(lines, ndmin=2) if any(line.strip() for line in lines) else np.empty((0, 2))
    except (ValueError, OSError) as error:
        raise Unusable(f"{file.name} is damaged ({limits.shown(str(error))})") from None
    if table.shape[1:] not in ((1,), (2,)) or not len(table):
        raise Unusable(f"{file.name}: expected the two columns time and value, or values alone")
    return table
