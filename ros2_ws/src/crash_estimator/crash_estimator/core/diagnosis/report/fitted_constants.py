"""The constants of the structure that a diagnosis has fitted beside the effects."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..output_error.gauss_newton import Fit


class FittedConstant(NamedTuple):
    """A stiffness or a damping that the model file leaves open."""

    element: str
    constant: str  # stiffness or damping
    value: float
    std: float
    unit: str


def fitted_constants(fitted: Fit) -> tuple[FittedConstant, ...]:
    """Of a structure's elements, in their order; a free curve has none."""
    return tuple(_each(fitted))


def _each(fitted: Fit) -> Iterator[FittedConstant]:
    names = {element.name for element in fitted.layout.structure.elements}
    for link in fitted.layout.links:
        for constant, p, unit in (("stiffness", link.constant, "N/m"), ("damping", link.damping, "N*s/m")):
            if link.name in names and p is not None:
                std = float(np.sqrt(fitted.covariance[p, p]))
                yield FittedConstant(link.name, constant, float(fitted.theta[p]), std, unit)
