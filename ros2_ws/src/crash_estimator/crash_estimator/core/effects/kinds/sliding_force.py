"""A force of an element that may act between its two bodies also where it is apart."""

from dataclasses import dataclass, replace

from ...structure import Coefficient, Element, ModelError
from ..effect import OwnLink
from ..estimator_model import element_index
from .element_force import ElementForce

SLIDING = "sliding"


@dataclass(frozen=True)
class SlidingForce(ElementForce):
    """A force in parallel to an element's own.

    In its form "sliding" it acts however far apart the element's bodies are: as of an occupant on a seat, beside a belt
    that carries only what pulls it.
    """

    def refuse(self, structure, spec):
        super().refuse(structure, spec)
        if spec.variant == SLIDING and not _comes_apart(structure.elements[element_index(structure, spec.target)]):
            raise ModelError(
                f"model {structure.name}: effect {spec.type} on {spec.target}: form {SLIDING!r} is of an element that "
                "comes apart: give it `tension: none` and no `displacement`, or leave the form out"
            )

    def put_to_work(self, structure, test, spec):
        if spec.variant != SLIDING:
            return super().put_to_work(structure, test, spec)
        between = structure.elements[element_index(structure, spec.target)].between
        path = Element(f"{spec.target}-{SLIDING}", between, Coefficient(0.0, shape="constant"))
        sliding = replace(structure, elements=(*structure.elements, path))
        return super().put_to_work(sliding, test, replace(spec, target=path.name, variant=""))

    def own_link(self, addition, structure, index, starts):
        if addition.variant != SLIDING:
            return None
        a, c = structure.elements[element_index(structure, addition.target)].between
        return OwnLink((index[a], index[c]), tension=True, origin=(), spring=False)

    def candidates(self, structure, magnitudes):
        for one in super().candidates(structure, magnitudes):
            if one.variant != SLIDING or _comes_apart(structure.elements[element_index(structure, one.target)]):
                yield one


def _comes_apart(element: Element) -> bool:
    return not (element.tension or element.displacement)
