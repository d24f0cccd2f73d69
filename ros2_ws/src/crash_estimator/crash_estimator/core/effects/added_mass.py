"""Added mass: (M + c) a = sum of forces; c in kg, by which the body is heavier than stated; below 0: lighter."""

import numpy as np

from .base import BodyInertia

EFFECT = BodyInertia("added_mass", "kg", low=-np.inf)
