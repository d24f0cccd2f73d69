"""A channel's zero jumps at the impact: recorded = true + c from time zero on, c in m/s^2, within 5 g.

Or it drifts, form `drift`: recorded = true + c t / 0.1 s, as that of a sensor that the blow has heated."""

from .base import ChannelError

LIMIT = 5.0 * 9.80665

EFFECT = ChannelError("channel_offset", "m/s^2", low=-LIMIT, high=LIMIT, size=0.5 * LIMIT, distorts="offset")
