"""The compiled recursion behind the same interface as `core.estimator.Estimator`: `init`, `step`, `description`."""

from typing import NamedTuple

import numpy as np

from crash_replay.recording import Sample, Test

from ..estimate import ElementState, Estimate, Event, ParameterStatus
from ..estimator import Estimator
from ..structure import Structure
from .follow import follow
from .layout import length, row_fields, slices, state_fields
from .plan import flat, make_method_plan, make_plan, make_size


class CompiledState(NamedTuple):
    """Everything the recursion remembers after a sample."""

    memory: np.ndarray  # flat, see layout.state_fields
    last_row: np.ndarray  # of the last sample, to tell what has changed


class CompiledEstimator:
    """Settings: a structure fitted to a test's channels, and RLS, MRLS or the Kalman filter."""

    def __init__(self, structure: Structure, test: Test, method, method_name: str):
        readable = Estimator(structure, test, method, method_name)  # checks everything, and names the outputs
        self.description = readable.description
        self.structure = structure
        self.method = method
        self.plan = make_plan(readable.kinematics, readable.contact, readable.regressor, method.settings)
        self.size = make_size(self.plan, method)
        self._settings = flat(self.size, make_method_plan(method), self.plan)
        self._estimated = np.ix_(self.plan.slot >= 0, self.plan.slot >= 0)
        self._state_length = length(state_fields(self.size))
        self._row_length = length(row_fields(self.size))
        self.columns = slices(row_fields(self.size))

    def init(self) -> CompiledState:
        memory, fields = np.zeros(self._state_length), slices(state_fields(self.size))
        plan = self.plan
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
        last_row = np.zeros(self._row_length)
        last_row[self.columns["state"]] = ElementState.APART
        return CompiledState(memory, last_row)

    def follow(
        self, state: CompiledState, times_ns: np.ndarray, values: np.ndarray
    ) -> tuple[CompiledState, np.ndarray]:
        """Fold a block of samples in -> the new state and one row of output a sample; `state` is left as it was.

        times_ns (k,) int64 ns since the impact; values (k, channels) SI. Rows (k, ...) hold `columns`.
        """
        after = CompiledState(state.memory.copy(), state.last_row.copy())
        rows = np.empty((len(times_ns), self._row_length))
        follow(*self._settings, *after, times_ns, values, rows)
        return after, rows

    def step(self, state: CompiledState, sample: Sample) -> tuple[CompiledState, Estimate]:
        """Fold one sample in; `state` is left as it was."""
        times = np.array([sample.time_ns], dtype=np.int64)
        after, rows = self.follow(state, times, sample.values.reshape(1, -1))
        return after, self.estimate(sample.number, sample.time_ns, rows[0], state.last_row)

    def estimate(self, number: int, time_ns: int, row: np.ndarray, before: np.ndarray) -> Estimate:
        """A row of output as an Estimate; `before` is the row before it, for the events."""
        p, q, columns = self.size.estimated, self.size.equations, self.columns
        covariance = row[columns["covariance"]].reshape(p, p)
        if p < self.size.parameters:
            of_estimated, covariance = covariance, np.zeros((self.size.parameters,) * 2)
            covariance[self._estimated] = of_estimated
        part = {name: row[place] for name, place in columns.items()}
        return Estimate(
            number=number,
            time_ns=time_ns,
            parameters=part["parameters"],
            covariance=covariance,
            status=part["status"].astype(np.uint8),
            measured=part["measured"],
            predicted=part["predicted"],
            innovation=part["innovation"],
            innovation_covariance=part["innovation_covariance"].reshape(q, q),
            residual=part["residual"],
            residual_std=part["residual_std"],
            crush=part["crush"],
            rate=part["rate"],
            force=part["force"],
            force_std=part["force_std"],
            state=part["state"].astype(np.uint8),
            displacement=part["displacement"],
            velocity=part["velocity"],
            acceleration=part["acceleration"],
            events=self.events(row, before, time_ns) if part["news"] else (),
        )

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
