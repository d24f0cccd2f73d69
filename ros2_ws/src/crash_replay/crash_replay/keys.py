"""What a terminal sends when a key is pressed, and what each key does to the replay. No terminal and no ROS here."""

import re
from bisect import bisect_left, bisect_right

from .player import HIGHEST_RATE, LOWEST_RATE

KEYS = {
    "space": "pause or resume",
    "right left": "one sample on or back, with shift ten",
    "up down": "faster or slower",
    "1 ... 9": "go to 10 % ... 90 %",
    "0 home": "to the start",
    "end": "to the last sample",
    "l": "loop on or off",
    "a b": "loop from or until here",
    "c": "the whole test again",
    "q": "quit",
    "h": "these keys",
}
HELP = "keys: " + ", ".join(f"{key} {meaning}" for key, meaning in KEYS.items())

SEQUENCE = re.compile(
    rb"\x1b(?:\[|O)(?:1;(?P<modifier>\d))?(?P<final>[A-DHF])|\x1b\[(?P<number>[1478])~|\x1b\[[0-9;]*[~A-Za-z]|.", re.S
)
"""A key in what xterm and its like send; with a number as tmux and rxvt do; then keys without a meaning here."""
INCOMPLETE = re.compile(rb"\x1b(?:\[[0-9;]*|O)?$")
ARROWS = {b"A": "up", b"B": "down", b"C": "right", b"D": "left", b"H": "home", b"F": "end"}
NUMBERED = {b"1": "home", b"4": "end", b"7": "home", b"8": "end"}
SHIFT = b"2"

RATES = [float(f"{digit}e{power}") for power in range(-3, 4) for digit in (1, 2, 5)]
RATES = [rate for rate in RATES if LOWEST_RATE <= rate <= HIGHEST_RATE]


def decode(data: bytes) -> tuple[list[str], bytes]:
    """Names of the keys in what was read, and what is the beginning of one that is not complete."""
    rest = INCOMPLETE.search(data)
    keys = []
    for match in SEQUENCE.finditer(data[: rest.start()] if rest else data):
        if match["final"]:
            keys.append(("shift+" if match["modifier"] == SHIFT else "") + ARROWS[match["final"]])
        elif match["number"]:
            keys.append(NUMBERED[match["number"]])
        elif len(match[0]) == 1:
            keys.append("space" if match[0] == b" " else match[0].decode("latin-1"))
    return keys, rest[0] if rest else b""


def next_rate(rate: float, faster: bool) -> float:
    """The next rate of 0.001, 0.002, 0.005, 0.01, ..., 1000."""
    if faster:
        return RATES[min(bisect_right(RATES, rate), len(RATES) - 1)]
    return RATES[max(bisect_left(RATES, rate) - 1, 0)]
