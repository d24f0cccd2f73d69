"""Masses stand as they were given: nats that a candidate must gain over another, where no measurement can tell them
apart and what is known of cars can."""

from ..effects.base import BodyInertia
from ..structure import Structure
from .layout import Addition
from .records import outputs_of

AS_GIVEN = 6.0
"""Nats that a body whose mass the model's own contain must gain over one beside them."""

WEIGHED = 12.0
"""Nats that a mass must gain over a law where the motion of one body is all that is measured: M a = F(X, V), and a
mass twice as large is a law half as hard. A car is weighed; its law is what the test is made to find."""


def against_a_mass(structure: Structure, addition: Addition) -> float:
    """Nats, of a heavier body among all candidates."""
    free = [body for body in structure.bodies if body.free]
    only_motion = len(free) == 1 and not any(output.fixed for output in outputs_of(structure))
    return WEIGHED if only_motion and isinstance(addition.effect, BodyInertia) else 0.0


def against_a_share(addition: Addition) -> float:
    """Nats, of an unmodelled body that was counted in with another, among its own variants.

    Without a measured force nothing tells it from one beside the model's masses: halving every force and mass leaves
    the motion as it is.
    """
    return AS_GIVEN if addition.taken_from else 0.0
