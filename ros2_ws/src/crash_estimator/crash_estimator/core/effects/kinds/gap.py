"""A crush that passes before an element carries anything."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..effect import Addition, Effect
from ..estimator_model import to_be_given, with_element

STARTS = (0.05, 0.12, 0.25, 0.45)
"""Shares of the largest crush that a search begins with: a fit reaches a factor of 2.4, from one to the next."""

TYPICAL = 0.3
"""Share of the crush scale that a gap is taken to be, for its prior."""


@dataclass(frozen=True)
class Gap(Effect):
    """The coefficient is a crush that passes before the element carries anything; no tension."""

    changes_law: ClassVar[bool] = True
    compression_only: ClassVar[bool] = True

    def put_to_work(self, structure, test, spec):
        if spec.coefficient is None:
            raise to_be_given(structure, spec, f"its coefficient, in {self.unit}")
        return with_element(structure, spec.target, origin=spec.coefficient, tension=False)

    def changed_law(self, law, c):
        return law._replace(gap=c, one_way=True)

    def law_derivative(self, on_line, lag, kx, kp):
        return -np.where(on_line, kx + kp, kx)

    def candidates(self, structure, magnitudes):
        for element in magnitudes.crushed_elements():
            largest = magnitudes.largest_crush(element.name)
            yield from (Addition(self, element.name, coefficient=share * largest) for share in STARTS)

    def prior_std(self, magnitudes, addition):
        return TYPICAL * magnitudes.crush[magnitudes.element(addition.target)]
