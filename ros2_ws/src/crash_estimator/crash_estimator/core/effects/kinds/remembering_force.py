"""A force in parallel to an element's own that hangs on the way its crush has gone."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar

import numpy as np

from ...structure import CONTACT_FREQUENCY, TYPICAL_CRUSH
from ..effect import Effect
from ..estimator_model import ROUGHLY, coefficient_of, element_index, with_action
from .element_force import HALF, on_element


@dataclass(frozen=True)
class RememberingForce(Effect):
    """A force c z in parallel to an element's own, compression positive; z is its memory.

    memory(time (g,) s, crush (g,) m, start, form=variant, **shape constants) -> z (g,) from `start` at the first crush
    on, dz_t/dz_{t-1} (g,), dz_t/dX_t and - dz_t/dX_{t-1} (g,). While the element is apart its crush counts as 0: the
    memory goes on from there.
    """

    memory: Callable[..., tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]] | None = None
    ways: tuple[str, ...] = ()  # forms beside the usual one, with the same shape constants, as common as that
    bounded: bool = True  # z is within -1 and 1

    remembers: ClassVar[bool] = True

    @property
    def variants(self):
        return ("", *self.ways)

    def put_to_work(self, structure, test, spec):
        k = element_index(structure, spec.target)
        scale = ROUGHLY * structure.reduced_mass(k) * CONTACT_FREQUENCY**2 * (TYPICAL_CRUSH if self.bounded else 1.0)
        memory = partial(self.memory, form=spec.variant, **spec.shape)
        return with_action(structure, spec, self.unit, "memory", k, coefficient_of(spec, self), scale, force=memory)

    def candidates(self, structure, magnitudes):
        for element in magnitudes.strained_elements():
            for addition in on_element(self, magnitudes, element.name):
                yield from (replace(addition, variant=form) for form in self.variants)

    def prior_std(self, magnitudes, addition):
        element = magnitudes.element(addition.target)
        carries = HALF * magnitudes.force[element]
        if self.bounded:
            return carries
        motions = [magnitudes.motion(r, element) for r in range(len(magnitudes.records))]
        memory = partial(self.memory, form=addition.variant, **addition.shapes)
        return carries / max(1e-12, *(np.abs(memory(m.time, m.crush, 0.0)[0]).max() for m in motions))
