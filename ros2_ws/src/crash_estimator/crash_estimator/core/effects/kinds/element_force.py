"""A force in parallel to an element's own, a function of its motion."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import ClassVar

import numpy as np

from ...structure import CONTACT_FREQUENCY, Coefficient, ModelError
from ..effect import Addition, Effect
from ..estimator_model import ROUGHLY, coefficient_of, element_index, typical_motion, with_action, with_element

IN_CURVE = "in_curve"
PLASTIC = "plastic"
SMOOTH = "smooth"
OF_THE_CURVE = IN_CURVE, PLASTIC, SMOOTH

HALF = 0.5
"""A coefficient's prior standard deviation carries this share of its target's largest force: as large as an effect
that a model can lack and still be one of that crash; the evidence changes by ln 2 for a factor of two."""


@dataclass(frozen=True)
class ElementForce(Effect):
    """A force in parallel to an element's own: c f, compression positive.

    force(motion: ElementMotion, **shape constants) -> (g,) N per unit of the coefficient

    Variants of a function of the crush alone: it is a spring beside the element's own (""); or a part of that one's
    curve, and unloads along the line that it has ("in_curve"), or, on an element of constant stiffness
    that has none, along a line of that stiffness ("plastic").
    """

    force: Callable[..., np.ndarray] | None = None
    doubles: str = ""  # the element's coefficient that the usual form doubles: where it is estimated, others are left
    includes: Sequence[str] = ()  # forms that are that coefficient and more: beside them, nothing is left to estimate

    function: ClassVar[str] = "force"
    in_parallel: ClassVar[bool] = True

    @property
    def variants(self):
        return ("", IN_CURVE) if self.of_crush_only and not self.forms else super().variants

    def replaces(self, variant):
        return self.doubles if variant in self.includes else ""

    def refuse(self, structure, spec):
        if spec.variant != PLASTIC:
            return
        element = structure.elements[element_index(structure, spec.target)]
        if element.unloads or _is_curve(element):
            raise ModelError(
                f"model {structure.name}: effect {spec.type} on {spec.target}: form {PLASTIC!r} is of an element of "
                f"one constant stiffness without a line: give it `shape: constant` and no `unloading`, or take "
                f"form {IN_CURVE!r}"
            )

    def put_to_work(self, structure, test, spec):
        k, force = element_index(structure, spec.target), partial(self.force, **spec.shape)
        replaced = self.replaces(spec.variant)
        if replaced and getattr(structure.elements[k], replaced).estimated:
            structure = with_element(structure, spec.target, **{replaced: Coefficient()})
        if spec.variant == PLASTIC:
            slope = structure.elements[k].stiffness.value or structure.reduced_mass(k) * CONTACT_FREQUENCY**2
            structure = with_element(structure, spec.target, unloading=slope)
        typical = typical_motion(structure, k)
        moved = np.abs(force(typical))
        scale = ROUGHLY * float(typical.static[0]) / float(moved[moved > 0.0][0] if moved.any() else 1.0)
        return with_action(
            structure, spec, self.unit, "element", k, coefficient_of(spec, self), scale, force=force,
            of_crush_only=self.of_crush_only, in_curve=spec.variant in OF_THE_CURVE,
        )  # fmt: skip

    def candidates(self, structure, magnitudes):
        for element in magnitudes.strained_elements():
            free_curve = _is_curve(element)
            # a free curve of an elastic element contains a function of the crush alone
            contained = self.of_crush_only and free_curve and not element.unloading
            doubled = bool(self.doubles and getattr(element, self.doubles).estimated)
            for variant in self.variants:
                needs = {
                    IN_CURVE: element.unloads and not free_curve,
                    PLASTIC: not (element.unloads or free_curve),
                    SMOOTH: not free_curve,
                }
                if not (contained or (doubled and not variant)) and needs.get(variant, True):
                    yield from on_element(self, magnitudes, element.name, variant)

    def prior_std(self, magnitudes, addition):
        element = magnitudes.element(addition.target)
        motions = [magnitudes.motion(r, element) for r in range(len(magnitudes.records))]
        reach = [np.abs(self.force(motion, **addition.shapes)) for motion in motions]
        largest = max(values[np.isfinite(values)].max(initial=0.0) for values in reach)
        return HALF * magnitudes.force[element] / max(largest, 1e-12)


def _is_curve(element) -> bool:
    """Whether its force is a free function of the crush."""
    return element.stiffness.estimated and element.stiffness.shape == "curve"


def on_element(effect: Effect, magnitudes, element: str, variant: str = ""):
    """One addition for each combination of the starts of its shape constants; none where one is a share of the crush,
    and there is none."""
    shapes = effect.shapes_of(variant)
    of_crush = any(shape.of_crush and not shape.both_ways for shape in shapes.values())
    if of_crush and element not in {crushed.name for crushed in magnitudes.crushed_elements()}:
        return
    names, unit = list(shapes), [magnitudes.shape_unit(shape, element) for shape in shapes.values()]
    for values in product(*(shape.starts for shape in shapes.values())):
        yield Addition(
            effect, element, {n: v * u for n, v, u in zip(names, values, unit, strict=True)}, variant=variant
        )
