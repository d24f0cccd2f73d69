"""A body that the model has not got, such as the engine in a one-mass frontal model.

It moves as an acceleration channel shows that the model does not use; the coefficient is its mass m in kg. Its
own balance, m a = sum of the forces on it, says what the bodies that it touches feel: together - m a, shared
between them by a free curve.
"""

from .base import AttachedBody

EFFECT = AttachedBody("unmodelled_body", "kg")
