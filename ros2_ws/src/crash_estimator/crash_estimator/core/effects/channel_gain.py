"""A channel's sensitivity is wrong: recorded = (1 + c) true, c within 10 %."""

from .base import ChannelError

EFFECT = ChannelError("channel_gain", "", low=-0.1, high=0.1, size=0.05, distorts="gain")
