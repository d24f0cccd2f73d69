"""The compiled recursion behind the same interface as `core.estimator.Estimator`: `init`, `step`, `description`."""

from dataclasses import fields
from typing import Any

import numpy as np

from crash_replay.recording import Sample, Test

from ..estimate import ROW as QUANTITIES
from ..estimate import ElementState, Estimate, Event, ParameterStatus
from ..estimator import Estimator
from ..structure import Structure
from .follow import follow, step
from .layout import ROW, STATE, length, slices
from .plan import flat, make_method_plan, make_plan, make_size


class CompiledEstimator:
    """Settings: a structure fitted to a test's channels, and RLS, MRLS or the Kalman filter.

    A state is one flat array: the last row, and what else the recursion remembers (`layout.STATE`).
    """

    def __init__(self, structure: Structure, test: Test, method, method_name: str):
        readable = Estimator(structure, test, method, method_name)  # checks everything, and names the outputs
        self.description = readable.description
        self.structure = structure
        self.method = method
        self.plan = make_plan(readable.kinematics, readable.contact, readable.regressor, method.settings)
        self.size = make_size(self.plan, method)
        self._settings = flat(self.size, make_method_plan(method), self.plan)
        self.estimated = np.ix_(self.plan.slot >= 0, self.plan.slot >= 0)
        self._row_length = length(ROW, self.size)
        self._state_length = self._row_length + length(STATE, self.size)
        self.columns = slices(ROW, self.size)
        own = {one.name for one in fields(Estimate)}
        self.parts = [(name, place) for name, place in self.columns.items() if name in own]

    def init(self) -> np.ndarray:
        state = np.zeros(self._state_length)
        state[self.columns["state"]] = ElementState.APART
        memory, fields, plan = state[self._row_length :], slices(STATE, self.size), self.plan
        memory[fields["clock"]] = -1.0, 0.0
        memory[fields["displacement"]] = plan.initial_displacement
        memory[fields["velocity"]] = plan.initial_velocity
        memory[fields["contact"]] = ElementState.APART
        offsets = np.zeros(self.size.offsets)  # their variance is known at the first update
        memory[fields["theta"]] = np.concatenate([plan.initial, offsets])
        memory[fields["covariance"]] = np.diag(plan.std**2).ravel()
        memory[fields["factors"]] = np.diag(np.concatenate([plan.std**2, offsets])).ravel()
        memory[fields["noise"]] = np.nan
        memory[fields["information"]] = np.diag(1.0 / plan.std**2).ravel()
        memory[fields["carried"]] = np.diag(plan.std**2).ravel()
        memory[fields["gamma"]] = 1.0
        memory[fields["stated"]] = memory[fields["covariance"]]
        memory[fields["walking"]] = plan.initial
        memory[fields["walking_noise"]] = np.nan
        return state

    def last_row(self, state: np.ndarray) -> np.ndarray:
        """The row of output of the last sample before this state, to tell what has changed."""
        return state[: self._row_length]

    def follow(self, state: np.ndarray, times_ns: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Fold a block of samples in -> the new state and one row of output a sample; `state` is left as it was.

        times_ns (k,) int64 ns since the impact; values (k, channels) SI. Rows (k, ...) hold `columns`.
        """
        after = state.copy()
        rows = np.empty((len(times_ns), self._row_length))
        follow(*self._settings, after, times_ns, values, rows)
        return after, rows

    def step(self, state: np.ndarray, sample: Sample) -> tuple[np.ndarray, Estimate]:
        """Fold one sample in; `state` is left as it was."""
        number, time_ns, values = sample
        after = np.empty(self._state_length)
        step(*self._settings, state, after, time_ns, values, self._row_length)
        return after, EstimateOfRow(self, number, time_ns, after, state)

    def events(self, row: np.ndarray, before: np.ndarray, time_ns: int) -> tuple[Event, ...]:
        """What has changed since the row before: contact, clamps, rewinds, dropouts."""
        columns, names = self.columns, self.description
        found = []
        for k in np.flatnonzero(row[columns["state"]] != before[columns["state"]]):
            kind, crush = ElementState(int(row[columns["state"]][k])).name.lower(), float(row[columns["crush"]][k])
            found.append(
                Event(kind, names.elements[k], crush, f"{names.elements[k]}: {kind} at crush {crush * 1e3:.1f} mm")
            )
        passes = int(row[columns["rewinds"]][0])
        if passes:
            m = self.size.window
            found.append(Event("rewound", "samples", float(passes * m), f"rewound {passes} x {m} samples"))
        clamped, was = (r[columns["status"]] == ParameterStatus.CLAMPED for r in (row, before))
        for k in np.flatnonzero(clamped & ~was):
            value = float(row[columns["parameters"]][k])
            found.append(
                Event("clamped", names.parameters[k], value, f"{names.parameters[k]}: held at its bound {value:g}")
            )
        missing, was = (np.isnan(r[columns["measured"]]) for r in (row, before))
        for k in np.flatnonzero(missing & ~was):
            text = f"{names.equations[k]}: no valid measurement, its equation is left out"
            found.append(Event("dropout", names.equations[k], time_ns * 1e-9, text))
        return tuple(found)


class EstimateOfRow(Estimate):
    """An Estimate that is read out of a row when something of it is asked for: of most, nothing is."""

    def __init__(self, of: CompiledEstimator, number: int, time_ns: int, row: np.ndarray, before: np.ndarray):
        """row: or a state, which begins with one; before: the row before it, for the events."""
        own = self.__dict__
        own["of"], own["number"], own["time_ns"], own["row"], own["before"] = of, number, time_ns, row, before

    def __getattr__(self, field: str) -> Any:
        """Called for what has not been read yet."""
        own = self.__dict__
        if "of" not in own or "events" in own:
            raise AttributeError(f"an Estimate has no {field}")
        of, row = self.of, self.row
        own.update({name: row[place] for name, place in of.parts})
        for name in CODES:
            own[name] = own[name].astype(np.uint8)
        p, q = of.size.estimated, of.size.equations
        own["innovation_covariance"] = own["innovation_covariance"].reshape(q, q)
        covariance = own["covariance"] = own["covariance"].reshape(p, p)
        if p < of.size.parameters:  # zero where one is known
            own["covariance"] = np.zeros((of.size.parameters,) * 2)
            own["covariance"][of.estimated] = covariance
        own["events"] = of.events(row, self.before, self.time_ns) if row[of.columns["news"]] else ()
        return getattr(self, field)


CODES = [name for name, quantity in QUANTITIES.items() if quantity.code]
