"""A force in parallel to an element's own, a function of its motion."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import ClassVar

import numpy as np

from ..effect import Addition, Effect
from ..estimator_model import ROUGHLY, coefficient_of, element_index, typical_motion, with_action

IN_CURVE = "in_curve"
HALF = 0.5
"""A coefficient's prior standard deviation carries this share of its target's largest force: as large as an effect
that a model can lack and still be one of that crash; the evidence changes by ln 2 for a factor of two."""


@dataclass(frozen=True)
class ElementForce(Effect):
    """A force in parallel to an element's own: c f, compression positive.

    force(motion: ElementMotion, **shape constants) -> (g,) N per unit of the coefficient

    Variants, of a function of the crush alone on an element that unloads along a line of its own: it is a spring beside
    that one (""), or a part of its curve, which unloads along the line ("in_curve").
    """

    force: Callable[..., np.ndarray] | None = None
    doubles: str = ""  # the element's own coefficient that says the same: none is offered where that is estimated

    function: ClassVar[str] = "force"
    in_parallel: ClassVar[bool] = True

    @property
    def variants(self):
        return ("", IN_CURVE) if self.of_crush_only else super().variants

    def put_to_work(self, structure, test, spec):
        k, force = element_index(structure, spec.target), partial(self.force, **spec.shape)
        typical = typical_motion(structure, k)
        moved = np.abs(force(typical))
        scale = ROUGHLY * float(typical.static[0]) / float(moved[moved > 0.0][0] if moved.any() else 1.0)
        return with_action(
            structure, spec, self.unit, "element", k, coefficient_of(spec, self), scale, force=force,
            of_crush_only=self.of_crush_only, in_curve=spec.variant == IN_CURVE,
        )  # fmt: skip

    def candidates(self, structure, magnitudes):
        for element in magnitudes.crushed_elements():
            free_curve = element.stiffness.estimated and element.stiffness.shape == "curve"
            # a free curve of an elastic element contains a function of the crush alone
            contained = self.of_crush_only and free_curve and not element.unloading
            if not (contained or (self.doubles and getattr(element, self.doubles).estimated)):
                beside_only = self.of_crush_only and (free_curve or not element.unloads)
                for variant in ("",) if beside_only else self.variants:
                    yield from on_element(self, magnitudes, element.name, variant)

    def prior_std(self, magnitudes, addition):
        element = magnitudes.element(addition.target)
        motions = [magnitudes.motion(r, element) for r in range(len(magnitudes.records))]
        reach = [np.abs(self.force(motion, **addition.shapes)) for motion in motions]
        largest = max(values[np.isfinite(values)].max(initial=0.0) for values in reach)
        return HALF * magnitudes.force[element] / max(largest, 1e-12)


def on_element(effect: Effect, magnitudes, element: str, variant: str = ""):
    """One addition for each combination of the starts of its shape constants."""
    shapes = effect.shapes_of(variant)
    names, unit = list(shapes), [magnitudes.shape_unit(shape, element) for shape in shapes.values()]
    for values in product(*(shape.starts for shape in shapes.values())):
        yield Addition(
            effect, element, {n: v * u for n, v, u in zip(names, values, unit, strict=True)}, variant=variant
        )
