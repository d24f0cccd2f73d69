"""A factor 1 + c h(V) on an element's static force."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import numpy as np

from ...structure import TYPICAL_RATE
from ..effect import Effect
from ..estimator_model import ROUGHLY, coefficient_of, element_index, with_action, with_element
from .element_force import HALF, on_element


@dataclass(frozen=True)
class StaticFactor(Effect):
    """A factor 1 + c h(V) on the static force.

    factor(rate (g,) m/s, **shape constants) -> (g,) h per unit of c;
    stated(c, **shape constants) -> the coefficient as the literature states it, and `unstated` back.
    """

    factor: Callable[..., np.ndarray] | None = None
    stated: Callable[..., float] = lambda c: c
    unstated: Callable[..., float] = lambda value: value

    function: ClassVar[str] = "factor"
    scales_static: ClassVar[bool] = True
    restated: ClassVar[bool] = True

    def stated_limits(self):
        return 0.0, np.inf

    def along(self, motion, **shapes):
        return self.factor(motion.rate, **shapes)

    def put_to_work(self, structure, test, spec):
        """Known: a property of the element. Estimated: c of 1 + c h(V), in which the force is linear."""
        k, h = element_index(structure, spec.target), partial(self.factor, **spec.shape)
        if spec.coefficient is None:
            scale = ROUGHLY / max(abs(float(h(np.array([TYPICAL_RATE]))[0])), 1e-9)
            return with_action(structure, spec, "", "factor", k, coefficient_of(spec, self), scale, force=h)
        c, before = self.unstated(spec.coefficient, **spec.shape), structure.elements[k].factor
        return with_element(
            structure, spec.target, factor=lambda rate: (1.0 + c * h(rate)) * (1.0 if before is None else before(rate))
        )

    def candidates(self, structure, magnitudes):
        for element in magnitudes.strained_elements():
            for variant in self.variants:
                yield from on_element(self, magnitudes, element.name, variant)

    def prior_std(self, magnitudes, addition):
        rate = magnitudes.rate[[magnitudes.element(addition.target)]]
        return HALF / max(float(self.factor(rate, **addition.shapes)[0]), 1e-12)
