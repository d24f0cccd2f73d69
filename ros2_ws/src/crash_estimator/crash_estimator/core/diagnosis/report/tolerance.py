"""How good is good enough: a share of the peak, or an ISO/TS 18571 rating."""

from typing import NamedTuple

from ...structure import ModelError
from .left import Left


def percent(share: float, digits: int = 3) -> str:
    return f"{100.0 * share:.{digits}g} %"


class Tolerance(NamedTuple):
    """What may be left in every channel of every recording: one of the two."""

    of_peak: float | None = None  # RMS as a share of the channel's largest value, in the band that is compared
    rating: float | None = None  # ISO/TS 18571, at least
    stated: bool = True  # by the user

    def admits(self, left: Left) -> bool:
        if self.rating is not None:
            return left.rating is not None and left.rating >= self.rating
        return left.of_peak <= self.of_peak

    @property
    def text(self) -> str:
        if self.rating is not None:
            return f"a rating of {self.rating:g}"
        return percent(self.of_peak) + ("" if self.stated else " (the default of --good-enough)")


DEFAULT = Tolerance(of_peak=0.01, stated=False)
"""1 % of the peak: less than two sensors on one body agree to. Of 36 development cases outside the vocabulary none left
so little as given. Nobody has asked for it, so that it passes over nothing that is known to be missing."""


def tolerance_of(text: str) -> Tolerance:
    """Raises ModelError where the text is neither a rating nor a share."""
    number = text.strip()
    try:
        value = float(number.removesuffix("%"))
    except ValueError:
        value = -1.0
    if number.endswith("%") and 0.0 < value < 100.0:
        return Tolerance(of_peak=value / 100.0)
    if not number.endswith("%") and 0.0 < value <= 1.0:
        return Tolerance(rating=value)
    raise ModelError(
        f"what is good enough is a rating from 0 to 1, as in 0.8, or a share of the peak, as in 5%; got {text!r}"
    )
