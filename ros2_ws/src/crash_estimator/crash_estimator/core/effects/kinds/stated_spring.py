"""A spring whose constant stiffness the model states, and states wrongly."""

from dataclasses import dataclass

from .element_force import ElementForce


@dataclass(frozen=True)
class StatedSpring(ElementForce):
    """A force c f of the crush beside a spring of k X that is not estimated."""

    def candidates(self, structure, magnitudes):
        stated = {element.name for element in structure.elements if _stated(element) > 0.0}
        yield from (one for one in super().candidates(structure, magnitudes) if one.target in stated)

    def limits(self, magnitudes, addition):
        """Some of the spring is there."""
        return -_stated(magnitudes.structure.elements[magnitudes.element(addition.target)]), self.high


def _stated(element) -> float:
    """N/m"""
    return 0.0 if element.stiffness.estimated else element.stiffness.value
