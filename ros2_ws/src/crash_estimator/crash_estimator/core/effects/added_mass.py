"""Added mass: the body is heavier than the model says, (M + c) a = sum of forces; c in kg, never negative."""

from .base import BodyInertia

EFFECT = BodyInertia("added_mass", "kg")
