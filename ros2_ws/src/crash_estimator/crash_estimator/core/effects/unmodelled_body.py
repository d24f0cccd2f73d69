"""A body that the model has not got, such as the engine in a one-mass frontal model.

It moves as an acceleration channel shows that the model does not use; the coefficient is its mass m in kg. Its
own balance, m a = sum of the forces on it, says what the bodies that it touches feel: together - m a, shared
between them by a free curve. Form `hung`: without a sensor, on a body of the model by a spring and a damper; it moves
as that body's own acceleration makes it swing, with the frequency in Hz that it has while the body is held and the
damping ratio (`core.hung_body`), and the body feels - m a.
"""

from .base import AttachedBody, Shape

EFFECT = AttachedBody(
    "unmodelled_body",
    "kg",
    {
        "frequency": Shape("Hz", 3.0, 300.0, (4.5, 7.0, 11.0, 18.0, 28.0, 45.0, 70.0, 110.0), no_usual=True),
        "damping": Shape("", 0.005, 0.7, (0.1,)),
    },
    forms={"": (), "hung": ("frequency", "damping")},
)
"""Below 3 Hz it hardly follows within a crash, and pulls like a spring to the ground; above 300 Hz it is the body's own
mass. A fit finds what is within a factor of 1.6 of its start: of two looked-at tests at 4.9 and 12 Hz that from 5 and
10 Hz, neither from 10 and 20. Rubber mounts have damping ratios of 0.05 to 0.2; beyond 0.7 nothing swings."""
