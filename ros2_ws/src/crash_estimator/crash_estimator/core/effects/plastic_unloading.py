"""Plastic unloading: from its peak the element comes down along a slope of its own, and carries no tension.

    F = F(X_peak) - c (X_peak - X)  where X < X_peak and F > 0,  else 0 on the way down

The coefficient is the slope c in N/m. Offered where the model has none, or with another slope than the model's.
"""

from .base import UnloadingSlope

EFFECT = UnloadingSlope("plastic_unloading", "N/m")
