"""Colours that can be told from a dark ground and from a white one: Rerun has both, and a drawing does not know which.

Contrast with Rerun's dark ground (13, 13, 14) and with white is at least 3, which is what graphics need (WCAG 2.1,
1.4.11); `tests/viewer/test_viewer_pieces.py` holds them to it.
"""

Color = tuple[int, int, int]
Shaded = tuple[int, int, int, int]

MEASURED: Color = (140, 140, 140)
ESTIMATOR_COLORS: tuple[Color, ...] = (
    (222, 104, 0),  # orange
    (30, 125, 225),  # blue
    (20, 150, 65),  # green
    (205, 75, 175),  # pink
    (165, 125, 0),  # yellow
    (130, 100, 225),  # violet
)
REVISION_COLORS: tuple[Color, ...] = ((225, 75, 60), (20, 150, 65), (30, 125, 225), (130, 100, 225), (205, 75, 175))
"""As given, then with one effect more each."""
TOLD: Color = (20, 150, 65)
CONFOUNDED: Color = (190, 115, 0)
WEAK: Color = (125, 125, 128)
"""What a candidate of the ranking is worth."""
FLOOR: Color = (165, 125, 0)
"""The sensors' noise."""
LIMIT_COLORS: tuple[Color, ...] = ((135, 130, 95), (165, 125, 0), (215, 85, 60))
"""Of the 90, 95 and 99 % limits of a correlation."""

INK: Color = (120, 120, 120)
TITLE: Color = (120, 120, 120)
GRID = (128, 128, 128, 80)
"""Translucent, so that it does not disturb."""

STATE_COLORS: tuple[Color, ...] = ((205, 85, 60), (60, 120, 200), (125, 125, 125))
"""Loading, unloading, apart."""
BODY: Color = (95, 115, 145)
PLATE: Color = (120, 120, 122)
EDGE: Color = (110, 125, 150)
APART: Color = (120, 120, 120)
FORCE_COLORS: tuple[Color, ...] = ((30, 110, 235), (130, 130, 130), (205, 125, 0), (225, 45, 35))
"""Tension, none, compression, the largest."""

_GREY = 150


def faded(color: Color) -> Color:
    """Of what a newer revision has taken the place of."""
    red, green, blue = ((2 * channel + 3 * _GREY) // 5 for channel in color)
    return red, green, blue
