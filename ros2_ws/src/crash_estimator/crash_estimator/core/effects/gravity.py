"""Gravity on a body that falls, as in a drop tower: M a = sum of forces + M c, and its accelerometer shows a - c.

It falls itself: zeroed before the impact, it does not show what gravity adds. c in m/s^2, positive in the travel
direction; 9.8 downwards, less on an incline. M is the mass that the model states.
"""

from crash_replay.gravity import G

from .base import Weight

LIMIT = 1.2 * G
"""No body falls faster; a fifth for what scales, gains and masses miss."""

EFFECT = Weight("gravity", "m/s^2", low=-LIMIT, high=LIMIT, size=G)
