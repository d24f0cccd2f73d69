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
    """The coefficient is a crush that passes before the element carries anything.

    Its variants: it then carries compression only (""), or as much passes to either side ("play").
    """

    changes_law: ClassVar[bool] = True
    variants: ClassVar[tuple[str, ...]] = ("", "play")

    def put_to_work(self, structure, test, spec):
        if spec.coefficient is None:
            raise to_be_given(structure, spec, f"its coefficient, in {self.unit}")
        if spec.variant == "play":
            return with_element(structure, spec.target, play=spec.coefficient)
        return with_element(structure, spec.target, origin=spec.coefficient, tension=False)

    def takes_tension_away(self, variant):
        return variant != "play"

    def changed_law(self, law, c, variant):
        return law._replace(gap=c, play=True) if variant == "play" else law._replace(gap=c, one_way=True)

    def law_derivative(self, side, on_line, lag, kx, kp):
        return -side * np.where(on_line, kx + kp, kx)

    def candidates(self, structure, magnitudes):
        for element in magnitudes.strained_elements():
            low, high = magnitudes.crush_range[magnitudes.element(element.name)]
            for variant in self.variants:
                largest = magnitudes.largest_crush(element.name, both_ways=variant == "play")
                pulled = element.tension and low < -STARTS[0] * largest
                shows = pulled if variant == "play" else high > 0.0
                for share in STARTS if shows else ():
                    yield Addition(self, element.name, coefficient=share * largest, variant=variant)

    def prior_std(self, magnitudes, addition):
        return TYPICAL * magnitudes.crush[magnitudes.element(addition.target)]
