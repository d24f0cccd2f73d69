"""What a file with a user's own effects imports: the kinds of effects, and what their functions are given."""

from .effect import Addition, Effect, ElementMotion, Shape
from .kinds import (
    AttachedBody,
    BodyForce,
    BodyInertia,
    ChannelError,
    ElementForce,
    Gap,
    HystereticForce,
    PairSpring,
    StaticFactor,
    UnloadingSlope,
)

__all__ = [
    "Addition", "AttachedBody", "BodyForce", "BodyInertia", "ChannelError", "Effect", "ElementForce", "ElementMotion",
    "Gap", "HystereticForce", "PairSpring", "Shape", "StaticFactor", "UnloadingSlope",
]  # fmt: skip
