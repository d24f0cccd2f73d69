"""Loading, unloading and separation of the elements (thesis 6.4.2, figure 6.5).

An element loads while its crush is the largest so far. One with a known unloading stiffness Ku then comes
down along the line from its peak,

    F = K X_peak - Ku (X_peak - X),

and climbs the same line again when it is reloaded. The known term Ku (X_peak - X) moves to the left side; K
stays the secant stiffness of the peak, which every sample on the line still tells something about. An element
without tension carries nothing where X <= 0, or where that line has come down to F = 0.
"""

from typing import NamedTuple

import numpy as np

from .estimate import ElementState, Event
from .kinematics import Motion
from .structure import Structure


class ContactState(NamedTuple):
    peak_crush: np.ndarray  # (e,) m, the largest so far, never below 0
    state: np.ndarray  # (e,) ElementState


class SpringLaw(NamedTuple):
    """The springs' force at this sample: F = K lever + shift."""

    lever: np.ndarray  # (e,) m: the crush, the peak crush on an unloading line, 0 when apart
    shift: np.ndarray  # (e,) N: - Ku (X_peak - X) on an unloading line
    carries: np.ndarray  # (e,) False when apart
    on_line: np.ndarray  # (e,) True on an unloading line


class Contact:
    """Settings: which element knows its unloading stiffness, which carries compression only."""

    def __init__(self, structure: Structure):
        self.names = [element.name for element in structure.elements]
        self.compression_only = np.array([not element.tension for element in structure.elements], dtype=bool)
        self.unloading = np.array([element.unloading or 0.0 for element in structure.elements])
        self.plastic = self.unloading > 0.0

    def init(self) -> ContactState:
        start = np.where(self.compression_only, ElementState.APART, ElementState.LOADING)
        return ContactState(np.zeros(len(self.names)), start.astype(np.uint8))

    def step(
        self, before: ContactState, motion: Motion, stiffness: np.ndarray
    ) -> tuple[ContactState, SpringLaw, tuple[Event, ...]]:
        """stiffness (e,): the latest known or estimated secant stiffness, N/m."""
        crush, peak = motion.crush, np.maximum(before.peak_crush, motion.crush)
        on_line = self.plastic & (crush < peak)
        lever = np.where(on_line, peak, crush)
        shift = np.where(on_line, self.unloading * (crush - peak), 0.0)
        spent = on_line & (stiffness * lever + shift <= 0.0)
        apart = self.compression_only & ((crush <= 0.0) | spent)
        unloads = np.where(self.plastic, on_line, motion.rate < 0.0)
        state = np.where(apart, ElementState.APART, np.where(unloads, ElementState.UNLOADING, ElementState.LOADING))
        state = state.astype(np.uint8)
        law = SpringLaw(np.where(apart, 0.0, lever), np.where(apart, 0.0, shift), ~apart, on_line & ~apart)
        return ContactState(peak, state), law, self._events(before.state, state, crush)

    def _events(self, before: np.ndarray, after: np.ndarray, crush: np.ndarray) -> tuple[Event, ...]:
        if (before == after).all():
            return ()
        events = []
        for k in np.flatnonzero(before != after):
            kind = ElementState(after[k]).name.lower()
            text = f"{self.names[k]}: {kind} at crush {crush[k] * 1e3:.1f} mm"
            events.append(Event(kind, self.names[k], float(crush[k]), text))
        return tuple(events)
