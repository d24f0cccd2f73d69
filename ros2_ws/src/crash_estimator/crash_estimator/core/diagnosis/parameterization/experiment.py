"""A recording under a parameter layout: what the mechanics and the fit go through one after the other."""

from collections.abc import Sequence
from typing import NamedTuple

from ..observation.record import ObservedRecord
from .layout import Layout


class Experiment(NamedTuple):
    """One of the recordings that a layout's parameters stand for, and which one it is."""

    layout: Layout
    record: ObservedRecord
    index: int  # type: ignore[assignment]  # among the layout's recordings; hides the tuple's own method


def experiments_of(layout: Layout, records: Sequence[ObservedRecord]) -> tuple[Experiment, ...]:
    """Raises ValueError where the layout was made for another number of recordings."""
    if len(records) != len(layout.offsets):
        raise ValueError(f"a layout of {len(layout.offsets)} recordings, got {len(records)}")
    return tuple(Experiment(layout, record, index) for index, record in enumerate(records))
