"""What varies with time, fitted as a rival of all effects: none of the vocabulary does.

    an element's static force is F (1 + s(t)),   a free body's mass m (1 + s(t)),   or a force s(t) pushes it,

one of these at a time; s(t) = sum of c_j cos(j pi t / T) with T the longest recording. So moves what breaks or heats
up, is pushed at some instant, loses mass or turns. `residuals.score_test` asks for the same to first order, of what a
model leaves; where much is missing, only the fit says how much of it this explains. What is named has to be likelier.
Of one recording nothing is asked: each function of the motion is one of time there.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from ...effects.base import BodyForce, StaticFactor
from ...effects.effect import Addition
from ...effects.kinds.element_force import HALF
from ..output_error.continuation import FROM_SIMULATION
from ..output_error.gauss_newton import Fit, fit
from ..output_error.problem import make_problem
from ..parameterization.magnitudes import Magnitudes
from ..residuals.score_test import MODES, MOST_NAMED, cosine
from .acceptance import cost_of_noise
from .fitted_model import Model
from .thresholds import THRESHOLDS


@dataclass(frozen=True)
class _Stiffness(StaticFactor):
    """A factor of time instead of the rate of crush."""

    def along(self, motion, **shapes):
        return self.factor(motion.time)


@dataclass(frozen=True)
class _Mass(BodyForce):
    """- m c_j cos(j pi t / T) a on the right side of m a = F, with the acceleration as it was measured."""

    def body_load(self, addition, structure, time, inertial, **shapes):
        body = structure.bodies[structure.body_index[addition.target]]
        return body.name, -body.mass * self.force(time) * inertial(body.acceleration[0])


class Varying(NamedTuple):
    """What varies, and the model with it."""

    what: str  # in words; several things where they cannot be told apart
    fit: Fit
    explained: float  # share of the misfit above the noise, in cost

    def leaves_much_less(self, others: Sequence[Fit]) -> bool:
        """It explains nearly all, and most of what each other fit leaves, none of which would be gone on with."""
        noise = cost_of_noise(self.fit.problem.records)
        most_of_it = all(self.fit.cost - noise < (1.0 - THRESHOLDS.most) * (one.cost - noise) for one in others)
        far_behind = all(self.fit.cost + THRESHOLDS.hopeless < one.cost for one in others)
        return self.explained > THRESHOLDS.nearly_all and most_of_it and far_behind


def likeliest_in_time(magnitudes: Magnitudes, model: Model, given: Fit, hopeless: float = np.inf) -> Varying | None:
    """The likeliest of all that may vary of a model; None of one recording, or where there is nothing.

    given: the model's fit in the sensors' noise; hopeless: cost above which another fit is not worth going on.
    """
    found = []
    for what, courses in _courses(magnitudes) if len(magnitudes.records) > 1 else ():
        problem = make_problem(magnitudes, magnitudes.records, [*model.additions, *courses], model.roughness)
        problem = problem.starting_as_found(given.layout, given.theta)
        start = problem.moved(problem.widened(given.layout, given.theta), given.trajectories)
        found.append((what, fit(problem, start, FROM_SIMULATION, hopeless)))
        hopeless = min(hopeless, found[-1][1].cost + THRESHOLDS.hopeless)
    if not found:
        return None
    found.sort(key=lambda one: one[1].evidence, reverse=True)
    best = found[0][1]
    alike = [what for what, one in found if one.evidence > best.evidence - THRESHOLDS.confounded][:MOST_NAMED]
    misfit = given.cost - cost_of_noise(magnitudes.records)
    return Varying(" or ".join(alike), best, float(np.clip((given.cost - best.cost) / max(misfit, 1.0), 0.0, 1.0)))


def _courses(magnitudes: Magnitudes) -> Iterator[tuple[str, list[Addition]]]:
    """Each thing that may vary, and the terms of its course."""
    longest = max(float(record.time[-1]) for record in magnitudes.records)
    courses = [(f"mode {j}", partial(cosine, j, longest)) for j in range(MODES + 1)]
    varying, free = courses[1:], [body for body in magnitudes.structure.bodies if body.free]
    for element in magnitudes.strained_elements():
        factors = (_Stiffness(name, "", factor=course, low=-np.inf, size=HALF) for name, course in varying)
        yield f"the stiffness of {element.name}", [Addition(factor, element.name) for factor in factors]
    for body in free:
        if body.acceleration and not body.derived:
            masses = (_Mass(name, "", force=course, low=-np.inf, size=HALF) for name, course in varying)
            yield f"the mass of {body.name}", [Addition(mass, body.name) for mass in masses]
    for body in free:
        forces = (BodyForce(name, "N", force=course, low=-np.inf) for name, course in courses)
        yield f"a force on {body.name}", [Addition(force, body.name) for force in forces]
