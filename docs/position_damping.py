"""Position-dependent damping, as of a hydraulic damper whose orifices close: F = c X V.

X is the crush in m, V its rate in m/s, compression positive; c in N s/m^2, never negative. Before contact, X < 0, none.
"""

import numpy as np

from crash_estimator.core.effects.base import ElementForce, ElementMotion


def force(motion: ElementMotion) -> np.ndarray:
    """N per unit of the coefficient, at every instant of a record."""
    return np.maximum(motion.crush, 0.0) * motion.rate


EFFECT = ElementForce("position_damping", "N*s/m^2", force=force)
