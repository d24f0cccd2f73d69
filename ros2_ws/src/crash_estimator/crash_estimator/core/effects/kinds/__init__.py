"""The kinds of effects: where each acts, what it adds to the equations, how it is estimated and searched for."""

from .attached_body import AttachedBody
from .body_force import BodyForce
from .body_inertia import BodyInertia
from .channel_error import ChannelError
from .element_force import ElementForce
from .gap import Gap
from .pair_spring import PairSpring
from .remembering_force import RememberingForce
from .static_factor import StaticFactor
from .unloading_slope import UnloadingSlope

__all__ = [
    "AttachedBody", "BodyForce", "BodyInertia", "ChannelError", "ElementForce", "Gap", "RememberingForce", "PairSpring",
    "StaticFactor", "UnloadingSlope",
]  # fmt: skip
