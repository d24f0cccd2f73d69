"""What a model file may leave open of a contact: whether its damper pulls, what acts where its spring is spent."""

from dataclasses import replace

import numpy as np

from ...structure import Structure
from ...structure_parts import ALL, SPRINGS
from ..mechanics.linearization import linearise
from ..output_error.gauss_newton import Fit
from ..parameterization.layout import experiments_of


def never_pulling(structure: Structure) -> Structure:
    """The structure whose dampers never pull where their element carries compression only."""
    elements = tuple(e if e.tension else replace(e, damper_pulls=False) for e in structure.elements)
    return replace(structure, elements=elements)


def elastic_when_spent(structure: Structure) -> Structure:
    """The structure where elastic forces beside a spring that is spent act on, as long as there is crush."""
    return _acting_when_spent(structure, SPRINGS)


def all_when_spent(structure: Structure) -> Structure:
    """The structure where all forces beside a spring that is spent act on, as long as there is crush."""
    return _acting_when_spent(structure, ALL)


def _acting_when_spent(structure: Structure, what: str) -> Structure:
    return replace(structure, elements=tuple(replace(e, acts_when_spent=what) for e in structure.elements))


def moves_otherwise(fitted: Fit, other: Structure) -> bool:
    """Whether the contacts of the other structure push any body otherwise along the fitted motion."""
    problem, elements = fitted.problem, {element.name: element for element in other.elements}
    links = (
        replace(link, damper_pulls=e.damper_pulls, acts_when_spent=e.acts_when_spent)
        if (e := elements.get(link.name))
        else link
        for link in problem.layout.links
    )
    layout = problem.layout._replace(links=tuple(links))
    pairs = zip(problem.experiments, experiments_of(layout, problem.records), fitted.trajectories, strict=True)
    for one, changed, trajectory in pairs:
        stated, otherwise = (linearise(experiment, fitted.theta, trajectory).rows for experiment in (one, changed))
        if not np.array_equal(stated, otherwise):
            return True
    return False
