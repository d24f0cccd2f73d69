"""An output-error problem: a parameter layout and the recordings that it is fitted to, and points of its space."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...effects.effect import Addition
from ..mechanics.driven_motion import measured_motion, motion_of
from ..observation.record import ObservedRecord
from ..observation.trajectory import Trajectory
from ..parameterization.layout import Experiment, Layout, experiments_of, make_layout
from ..parameterization.magnitudes import Magnitudes


class Point(NamedTuple):
    """Parameters, and a motion for each recording, which need not be the simulation with these parameters yet."""

    theta: np.ndarray  # (p,)
    trajectories: Sequence[Trajectory]


class OutputErrorProblem(NamedTuple):
    """Find the parameters whose simulation is closest to all measured outputs."""

    layout: Layout
    experiments: tuple[Experiment, ...]

    @property
    def records(self) -> tuple[ObservedRecord, ...]:
        return tuple(experiment.record for experiment in self.experiments)

    @property
    def noise_is_inflated(self) -> bool:
        return self.experiments[0].record.noise_is_inflated

    def on(self, records: Sequence[ObservedRecord]) -> "OutputErrorProblem":
        """The same parameters on other records of the same tests, as with other noise."""
        return OutputErrorProblem(self.layout, experiments_of(self.layout, records))

    def starting_at(self, start: np.ndarray, trusted: Sequence[int] = ()) -> "OutputErrorProblem":
        """The same with other starting values (p,).

        trusted: of parameters that the measured motion would mislead. The crush of a stiff element between two bodies
        is a small difference of two motions, each with errors of its own: along it the stiffness comes out too low, and
        a simulation that swings too slowly is drawn no nearer.
        """
        layout = self.layout._replace(start=start, trusted=(*self.layout.trusted, *trusted))
        return self._replace(layout=layout).on(self.records)

    def starting_as_stated(self) -> "OutputErrorProblem":
        """The same with constant stiffnesses that start as the model file says."""
        stated, start = self.layout.stated, self.layout.start.copy()
        start[list(stated)] = list(stated.values())
        return self.starting_at(start, list(stated))

    def starting_as_found(self, narrow: Layout, theta: np.ndarray) -> "OutputErrorProblem":
        """The same with constant stiffnesses that start as they were found with fewer effects."""
        stiff, start = list(self.layout.stated), self.layout.start.copy()
        start[stiff] = self.widened(narrow, theta)[stiff]
        return self.starting_at(start, stiff)

    def measured(self, theta: np.ndarray) -> Point:
        """Parameters, and the motions that the sensors show if they err as these say."""
        return Point(theta, [measured_motion(experiment, theta) for experiment in self.experiments])

    def moved(self, theta: np.ndarray, trajectories: Sequence[Trajectory]) -> Point:
        """Parameters, and the motions in which free bodies accelerate as in the trajectories."""
        pairs = zip(self.experiments, trajectories, strict=True)
        return Point(theta, [motion_of(experiment, theta, trajectory.a) for experiment, trajectory in pairs])

    def widened(self, narrow: Layout, theta: np.ndarray) -> np.ndarray:
        """Parameters (p,) of a problem with fewer of them, the others as they start."""
        wide = self.layout.start.copy()
        wide[embedding(narrow, self.layout)] = theta
        return wide

    def narrowed(self, wide: Layout, point: Point) -> Point:
        """A point of a problem with more additions, without those that this one has not."""
        return self.moved(point.theta[embedding(self.layout, wide)], point.trajectories)


def make_problem(
    magnitudes: Magnitudes, records: Sequence[ObservedRecord], additions: Sequence[Addition],
    roughness: Mapping[str, np.ndarray] | None = None,
) -> OutputErrorProblem:  # fmt: skip
    """A structure with additions on records; roughness: of its curves, where it is not the usual one."""
    layout = make_layout(records, magnitudes, additions, roughness)
    return OutputErrorProblem(layout, experiments_of(layout, records))


def embedding(base: Layout, wide: Layout) -> np.ndarray:
    """Where the base's parameters are in a layout that has additions beside them."""
    names = {name: wide.knots + k for k, name in reversed(list(enumerate(wide.names)))}
    found = [*range(base.knots), *(names[name] for name in base.names)]
    for r in range(len(base.offsets)):
        found += [wide.offsets[r] + q for q in range(len(base.outputs))]
        found += [wide.drifts[r][q] for q in base.drifts[r]]
        for body in base.modes[r]:
            found += wide.modes[r][body]
        found += [wide.kicks[r][body] for body in base.kicks[r]]
        for body in base.pushes[r]:
            found += wide.pushes[r][body]
        found += [wide.late[r]] if base.late[r] >= 0 else []
    return np.array(found)
