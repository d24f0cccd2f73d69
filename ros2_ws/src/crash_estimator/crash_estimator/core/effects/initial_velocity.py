"""A stated initial velocity is wrong: v0 = (1 + c) stated, c within 10 %, of all bodies that start as fast."""

from .kinds import BodyStart

EFFECT = BodyStart("initial_velocity", "", low=-0.1, high=0.1, size=0.05)
