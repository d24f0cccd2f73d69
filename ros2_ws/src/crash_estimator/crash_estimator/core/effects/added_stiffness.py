"""Added stiffness: F = c X beside a spring whose stiffness the model states and does not estimate.

X is the crush in m, compression positive; c in N/m, by which the spring is stiffer than stated; below 0: softer. Form
`in_curve`: the spring unloads along a line, and so does what is added.
"""

import numpy as np

from .base import ElementMotion, StatedSpring


def force(motion: ElementMotion):
    return motion.crush


EFFECT = StatedSpring("added_stiffness", "N/m", low=-np.inf, force=force, of_crush_only=True)
