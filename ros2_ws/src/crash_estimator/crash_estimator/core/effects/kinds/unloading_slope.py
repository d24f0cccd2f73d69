"""The slope of the line on which an element unloads from its peak."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ...structure import CONTACT_FREQUENCY
from ..effect import Addition, Effect
from ..estimator_model import coefficient_of, element_index, with_element

STARTS = (1.0, 2.5, 6.0)
"""In stiffness scales of the element: from where a line is as steep as its curve to near vertical ..."""

BESIDE_THE_MODELS = (0.6, 1.8)
"""... or, where the model has a slope, in that: one on either side, as its own explains nothing more."""

STEEPEST, LEAST = 10.0, 0.3
"""In stiffness scales: the prior's standard deviation, and what is no line of its own but the curve's way back."""


@dataclass(frozen=True)
class UnloadingSlope(Effect):
    """The coefficient is the slope of the line on which the element unloads from its peak; no tension."""

    changes_law: ClassVar[bool] = True
    profiled: ClassVar[bool] = True

    def replaces(self, variant):
        return "unloading"

    def put_to_work(self, structure, test, spec):
        if spec.coefficient is not None:
            return with_element(structure, spec.target, unloading=spec.coefficient, unloading_slope=None, tension=False)
        first = structure.reduced_mass(element_index(structure, spec.target)) * CONTACT_FREQUENCY**2
        slope = replace(coefficient_of(spec, self), value=first)
        return with_element(structure, spec.target, unloading=None, unloading_slope=slope, tension=False)

    def takes_tension_away(self, variant):
        return True

    def changed_law(self, law, c, variant):
        return law._replace(unloads=True, slope=c, one_way=True)

    def law_derivative(self, side, on_line, lag, kx, kp):
        return np.where(on_line, lag, 0.0)

    def candidates(self, structure, magnitudes):
        for element in magnitudes.crushed_elements():
            stiffness = magnitudes.stiffness[magnitudes.element(element.name)]
            known = element.unloading
            for slope in [s * known for s in BESIDE_THE_MODELS] if known else [s * stiffness for s in STARTS]:
                yield Addition(self, element.name, coefficient=slope)

    def is_doubt(self, magnitudes, addition, c, shapes, fitted):
        """A line that is less steep than the element loads gives back more than it took."""
        loading = fitted.constant_stiffness(addition.target)
        return loading is not None and c < loading

    def prior_std(self, magnitudes, addition):
        return STEEPEST * magnitudes.stiffness[magnitudes.element(addition.target)]

    def limits(self, magnitudes, addition):
        return LEAST * magnitudes.stiffness[magnitudes.element(addition.target)], self.high
