"""An element that gives way: F = - c (X - yield_crush) where the crush X exceeds that, beside the element's own force.

X in m, compression positive; c in N/m, never negative, is the stiffness that is lost there; where it yields is found.
As large as the element's own stiffness k it is a force limiter, with a plateau at k times `yield_crush`; smaller, a
curve of two slopes. Of an element whose stiffness is known no more is lost than it has. A free curve of an elastic
element contains it, so it is offered where the element's stiffness is one constant or known, or unloads along a line.
The way back is the way that it came; form `in_curve`: it is a part of the spring's own curve, and unloads along the
same line. Form `plastic`, of a force limiter that stays bent, as a belt's or a sheet's: from the largest crush so far
it springs back as stiff as it was at first. `hysteresis` says the same of a small part of an element's force, as of a
dry slider behind a spring, which yields on the way back as well.

Form `smooth`, a part of the curve too, of foams, honeycombs and all that has no corner (of hardening metals Voce 1948):
F = - c (X - L (1 - exp(-X / L))) where X > 0, L the `fading_crush` over which the stiffness fades: with c as large as k
the element's force is k L (1 - exp(-X / L)).
"""

from dataclasses import dataclass, replace

import numpy as np

from .base import ElementForce, ElementMotion, Shape
from .kinds.element_force import HALF, IN_CURVE, PLASTIC, SMOOTH

MAIN_PART = 0.5
"""Of the largest force of an element, that it must yield at to be called plastic: of two names of one law, the one that
says what most of the force does. The dry sliders of both simulators take 0.12 to 0.35, of 12 looked-at force limiters
it was 0.99 and more."""


@dataclass(frozen=True)
class Loss(ElementForce):
    """Stiffness that an element loses."""

    def limits(self, magnitudes, addition):
        stiffness = magnitudes.structure.elements[magnitudes.element(addition.target)].stiffness
        return self.low, self.high if stiffness.estimated else stiffness.value

    def prior_std(self, magnitudes, addition):
        """It may be all that there was, which takes the element's force over the crush where it yields."""
        element = magnitudes.element(addition.target)
        (crush,) = addition.shapes.values()
        return HALF * magnitudes.force[element] / crush

    def common(self):
        return replace(self, forms={form: shapes for form, shapes in self.forms.items() if form != SMOOTH})

    def is_doubt(self, magnitudes, addition, c, shapes, fitted):
        if addition.variant != PLASTIC:
            return False
        yields_at = c * shapes["yield_crush"]  # N
        return yields_at < MAIN_PART * fitted.largest_force(addition.target)


def force(motion: ElementMotion, yield_crush: float = 0.0, fading_crush: float = 0.0):
    beyond = np.maximum(motion.crush - yield_crush, 0.0)
    return -(beyond + fading_crush * np.expm1(-beyond / fading_crush)) if fading_crush else -beyond


EFFECT = Loss(
    "yielding",
    "N/m",
    {
        "yield_crush": Shape("m", 0.03, 0.97, (0.1, 0.3, 0.6), of_crush=True),
        "fading_crush": Shape("m", 0.03, 3.0, (0.1, 0.4), of_crush=True),
    },
    force=force,
    of_crush_only=True,
    forms={"": ("yield_crush",), IN_CURVE: ("yield_crush",), PLASTIC: ("yield_crush",), SMOOTH: ("fading_crush",)},
)
"""Limits of `yield_crush` as of a stop, and lower: a limiter yields early. Of `fading_crush` as low; at three times the
crush the stiffness has fallen by 28 % at its end, which a cubic term may say as well: halved and doubled it changed
nothing of 32 looked-at cases. With its starts halved or doubled one of 20 looked-at foams was unexplained, with these
none, in 1.05 and 1.13 times the iterations."""
