"""Which cases judge: every form of every effect, nothing hidden, what no vocabulary has, and sensors in trouble."""

from collections.abc import Iterator
from functools import cache
from itertools import islice

import numpy as np

from .cases import NOTHING, Case
from .forms import FORMS
from .structures import STRUCTURES

SEEDS = 20_000_000
"""The first of the judging seeds. Nothing may be built on them: only the page's own run looks at them."""

DEVELOPMENT = 71_000_000
"""The first seed of the cases that were looked at while the simulator was made, and that may be tuned on."""

LOOKED_AT = 14675
"""Cases whose answers were looked at: development ones, and the 300 of forty-four earlier judgements each, from 21 to
31, 33 to 55, 57 to 62 and 67 to 70 million on, the first 140 from 56 million on, 47 from 66, 136 from 65 and 152 from
63 million on, and 12 from 32 million on. Those from 64 million on are left out: whether somebody looked at them is not
known."""

NOISES = (0.5, 1.0, 2.0)
MILD = ("clean", "coloured", "ringing", "cfc180", "1khz", "masses", "drifting")
"""With which a model that lacks nothing is still adequate."""

TROUBLE = ("coloured", "ringing", "cfc180", "clipped", "shifted")
COUNTS = {"one": 196, "nothing": 40, "outside": 30, "trouble": 34}


@cache
def plan(first_seed: int = SEEDS) -> tuple[Case, ...]:
    """All 300 in a mixed order, so that any beginning of it is a sample of the whole; each has a seed of its own."""
    ways = {"one": _one(), "nothing": _nothing(), "outside": _outside(), "trouble": _trouble()}
    drawn = [case for kind, count in COUNTS.items() for case in islice(ways[kind], count)]
    order = np.random.default_rng(2).permutation(len(drawn)).tolist()
    return tuple(Case._make((*drawn[k], first_seed + n)) for n, k in enumerate(order))


def kind_of(case: Case) -> str:
    """A key of COUNTS."""
    if case.form == NOTHING:
        return "nothing"
    if FORMS[case.form].outside:
        return "outside"
    return "one" if case.nuisance == "clean" else "trouble"


def _one() -> Iterator[tuple]:
    yield from ((*pair, noise, "clean") for pair, noise in _mixed(False))


def _outside() -> Iterator[tuple]:
    yield from ((*pair, noise, "clean") for pair, noise in _mixed(True))


def _trouble() -> Iterator[tuple]:
    for n, (pair, noise) in enumerate(_mixed(False)):
        yield *pair, noise, TROUBLE[n % len(TROUBLE)]


def _nothing() -> Iterator[tuple]:
    n = 0
    while True:
        yield list(STRUCTURES)[n % 4], NOTHING, NOISES[n // 4 % 3], MILD[n % 7]
        n += 1


def _mixed(outside: bool) -> Iterator[tuple[tuple[str, str], float]]:
    """Form after form, each time in its next structure and with the next noise."""
    forms = [(name, list(form.targets)) for name, form in FORMS.items() if form.outside == outside]
    turn = 0
    while True:
        for k, (name, structures) in enumerate(forms):
            yield (structures[(turn + k) % len(structures)], name), NOISES[(turn + k // 2) % 3]
        turn += 1
