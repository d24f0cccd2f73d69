"""A channel lags: recorded(t) = true(t - c), c in s, from 0 to 1 ms (a filter, or a late trigger)."""

from .base import ChannelError

EFFECT = ChannelError("channel_delay", "s", high=1e-3, size=4e-4, distorts="delay")
