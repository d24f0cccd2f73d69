"""A load cell's zero jumps at the impact: recorded = true + c from time zero on, c in N.

Or it drifts, form `drift`: recorded = true + c t / 0.1 s."""

import numpy as np

from .base import ChannelError

EFFECT = ChannelError("force_offset", "N", low=-np.inf, distorts="offset", of_force=True, rare=True)
