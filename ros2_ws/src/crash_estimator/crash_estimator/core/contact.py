"""Loading, unloading and separation of the elements (thesis 6.4.2, figure 6.5).

An element loads while its crush is the largest so far. One with a known unloading stiffness Ku then comes
down along the line from its peak,

    F = K X_peak - Ku (X_peak - X),

and climbs the same line again when it is reloaded. The known term Ku (X_peak - X) moves to the left side; K
stays the secant stiffness of the peak, which every sample on the line still tells something about. An element
without tension carries nothing where X <= 0, or where that line has come down to F = 0; one whose damper never pulls,
where K X + C V < 0 either, with the latest K and C. One whose forces beside the spring act when that is spent
(`acts_when_spent`) is apart for its spring alone, until X <= 0. Before the impact no element carries anything.
"""

from typing import NamedTuple

import numpy as np

from .estimate import ElementState, Event
from .kinematics import Motion
from .structure import Structure
from .structure_parts import NOTHING

REVERSAL = 0.02
"""Share of the largest rate below which an elastic element's rate counts as noise, not as turning back."""


class ContactState(NamedTuple):
    peak_crush: np.ndarray  # (e,) m, the largest so far, never below 0
    peak_rate: np.ndarray  # (e,) m/s, the largest magnitude so far
    state: np.ndarray  # (e,) ElementState
    crush: np.ndarray  # (e,) m, at the last sample; 0 where apart without tension
    memory: np.ndarray  # (n,) of each action that remembers the way its element's crush has gone; else 0


class SpringLaw(NamedTuple):
    """The springs' force at this sample: F = K lever + shift."""

    lever: np.ndarray  # (e,) m: the crush, the peak crush on an unloading line, 0 when apart
    shift: np.ndarray  # (e,) N: - Ku (X_peak - X) on an unloading line
    carries: np.ndarray  # (e,) False when apart
    crushed: np.ndarray  # (e,) what outlasts the spring acts: True as well where that is spent
    on_line: np.ndarray  # (e,) True on an unloading line
    peak: np.ndarray  # (e,) m, the largest crush so far
    memory: np.ndarray  # (n,) of each action


class Contact:
    """Settings: which element knows its unloading stiffness, which carries compression only."""

    def __init__(self, structure: Structure):
        self.names = [element.name for element in structure.elements]
        self.compression_only = np.array([not element.tension for element in structure.elements], dtype=bool)
        self.lasting = np.array([element.acts_when_spent != NOTHING for element in structure.elements], dtype=bool)
        self.never_pulls = np.array([not element.damper_pulls for element in structure.elements], dtype=bool)
        slopes = [element.unloading_slope for element in structure.elements]  # of the estimated ones, at first
        self.unloading = np.array([e.unloading or (s.value if s else 0.0) for e, s in zip(structure.elements, slopes)])
        self.plastic = self.unloading > 0.0
        self.actions = structure.actions

    def init(self) -> ContactState:
        n = len(self.names)
        apart = np.full(n, ElementState.APART, dtype=np.uint8)
        return ContactState(np.zeros(n), np.zeros(n), apart, np.zeros(n), np.zeros(len(self.actions)))

    def step(
        self,
        before: ContactState,
        motion: Motion,
        stiffness: np.ndarray,
        unloading: np.ndarray | None = None,
        damping: np.ndarray | float = 0.0,
        inside: np.ndarray | float = 0.0,
    ) -> tuple[ContactState, SpringLaw, tuple[Event, ...]]:
        """stiffness (e,): the latest known or estimated secant stiffness, N/m; unloading (e,) where it is estimated;
        damping (e,): the latest, N s/m, which counts where a damper never pulls; inside (e,): what effects add to the
        springs' own curves, N."""
        if motion.time < 0.0:
            nothing, none = np.zeros(len(self.names)), np.zeros(len(self.names), dtype=bool)
            return before, SpringLaw(nothing, nothing, none, none, none, before.peak_crush, before.memory), ()
        crush, peak = motion.crush, np.maximum(before.peak_crush, motion.crush)
        on_line = self.plastic & (crush < peak)
        lever = np.where(on_line, peak, crush)
        slope = self.unloading if unloading is None else unloading
        shift = np.where(on_line, slope * (crush - peak), 0.0)
        spring = stiffness * lever + inside + shift
        spent = on_line & (spring <= 0.0)
        spring = np.where(spent, 0.0, spring)
        off = self.compression_only & ((crush <= 0.0) | self.never_pulls & (spring + damping * motion.rate < 0.0))
        apart = off | self.compression_only & spent
        peak_rate = np.maximum(before.peak_rate, np.abs(motion.rate))
        still = np.abs(motion.rate) <= REVERSAL * peak_rate
        turned = np.where(still, before.state == ElementState.UNLOADING, motion.rate < 0.0)
        unloads = np.where(self.plastic, on_line, turned)
        state = np.where(apart, ElementState.APART, np.where(unloads, ElementState.UNLOADING, ElementState.LOADING))
        state = state.astype(np.uint8)
        pressed = np.where(self.compression_only, np.maximum(crush, 0.0), crush)
        memory = self._remembered(before, pressed, motion.dt)
        law = SpringLaw(
            np.where(apart, 0.0, lever), np.where(apart, 0.0, shift), ~apart, ~apart | self.lasting & ~off,
            on_line & ~apart, peak, memory,
        )  # fmt: skip
        return ContactState(peak, peak_rate, state, pressed, memory), law, self._events(before.state, state, crush)

    def _remembered(self, before: ContactState, crush: np.ndarray, dt: float) -> np.ndarray:
        time, memory = np.array([0.0, dt]), before.memory.copy()
        for j, action in enumerate(self.actions):
            if action.kind == "memory":
                way = np.array([before.crush[action.at], crush[action.at]])
                memory[j] = action.force(time, way, before.memory[j])[0][-1]
        return memory

    def _events(self, before: np.ndarray, after: np.ndarray, crush: np.ndarray) -> tuple[Event, ...]:
        if (before == after).all():
            return ()
        events = []
        for k in np.flatnonzero(before != after):
            kind = ElementState(after[k]).name.lower()
            text = f"{self.names[k]}: {kind} at crush {crush[k] * 1e3:.1f} mm"
            events.append(Event(kind, self.names[k], float(crush[k]), text))
        return tuple(events)
