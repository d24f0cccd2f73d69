"""The constants of the structure that a diagnosis has fitted beside the effects."""

from typing import NamedTuple

import numpy as np

from ..output_error.gauss_newton import Fit


class FittedConstant(NamedTuple):
    """A stiffness, a damping or an unloading stiffness that the model file leaves open."""

    element: str
    constant: str  # stiffness, damping or unloading
    value: float
    std: float
    unit: str


def fitted_constants(fitted: Fit) -> tuple[FittedConstant, ...]:
    """Of a structure's elements, in their order; a free curve has none."""
    found = []
    elements = {element.name: element for element in fitted.layout.structure.elements}
    for link in (link for link in fitted.layout.links if link.name in elements):
        constants = [("stiffness", link.constant, "N/m"), ("damping", link.damping, "N*s/m")]
        if elements[link.name].unloading_slope:
            lines = [term.coefficient for term in link.terms if term.addition.effect.replaces("") == "unloading"]
            constants += [("unloading", p, "N/m") for p in lines]
        for constant, p, unit in constants:
            if p is not None:
                std = float(np.sqrt(fitted.covariance[p, p]))
                found.append(FittedConstant(link.name, constant, float(fitted.theta[p]), std, unit))
    return tuple(found)
