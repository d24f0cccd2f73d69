"""What a file with a user's own effects imports: the kinds of effects, and what their functions are given.

`RememberingForce` is not among them: what a user's function gives is looked at before it is believed (`user.py`), and
of a memory with its derivatives that is not done yet.
"""

from .effect import Addition, Effect, ElementMotion, Shape
from .kinds import (
    AttachedBody,
    BodyForce,
    BodyInertia,
    BodyStart,
    ChannelError,
    ElementForce,
    Gap,
    GuideForce,
    PairSpring,
    SlidingForce,
    StatedSpring,
    StaticFactor,
    UnloadingSlope,
    Weight,
)

__all__ = [
    "Addition", "AttachedBody", "BodyForce", "BodyInertia", "BodyStart", "ChannelError", "Effect", "ElementForce",
    "ElementMotion", "Gap", "GuideForce", "PairSpring", "Shape", "SlidingForce", "StatedSpring", "StaticFactor",
    "UnloadingSlope", "Weight",
]  # fmt: skip
