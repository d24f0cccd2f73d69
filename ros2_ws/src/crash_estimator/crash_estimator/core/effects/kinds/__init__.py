"""The kinds of effects: where each acts, what it adds to the equations, how it is estimated and searched for."""

from .attached_body import AttachedBody
from .body_force import BodyForce
from .body_inertia import BodyInertia
from .body_start import BodyStart
from .channel_error import ChannelError
from .element_force import ElementForce
from .gap import Gap
from .guide_force import GuideForce
from .pair_spring import PairSpring
from .remembering_force import RememberingForce
from .sliding_force import SlidingForce
from .stated_spring import StatedSpring
from .static_factor import StaticFactor
from .unloading_slope import UnloadingSlope
from .weight import Weight

__all__ = [
    "AttachedBody", "BodyForce", "BodyInertia", "BodyStart", "ChannelError", "ElementForce", "Gap", "GuideForce",
    "PairSpring", "RememberingForce", "SlidingForce", "StatedSpring", "StaticFactor", "UnloadingSlope", "Weight",
]  # fmt: skip
