"""A limit to how long a search goes on. It is looked at between fits, so that the best answer so far is given."""

import math
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from time import monotonic

from ..output_error.gauss_newton import iterations_made

LONGEST_SEARCH = 4000
"""Gauss-Newton iterations of a search for which no time is stated: 10 s for two recordings of a dummy. Of 299 looked-at
cases of the second simulator 2 took more; of 73 that had been picked since they took longest 13 did, as many as 8744.
Of 17 of them all that took more than 3900 one of 14 right answers is lost; with 2500, of 37 above 2000, five of 34."""

_end: ContextVar[tuple[float, float]] = ContextVar("end", default=(math.inf, math.inf))  # s, iterations


@contextmanager
def _until(deadline: float, most: float) -> Iterator[None]:
    token = _end.set((deadline, most))
    try:
        yield
    finally:
        _end.reset(token)


def search_limit(seconds: float | None) -> AbstractContextManager[None]:
    """For what is called within; None: `LONGEST_SEARCH`, whatever time that takes; inf: none."""
    if seconds is None:
        return _until(math.inf, iterations_made() + LONGEST_SEARCH)
    return _until(monotonic() + seconds, math.inf)


def half_of_what_is_left() -> AbstractContextManager[None]:
    """For a search within another one, which goes on after it."""
    deadline, most = _end.get()
    now, made = monotonic(), iterations_made()
    return _until(now + 0.5 * (deadline - now), made + 0.5 * (most - made))


def search_is_over() -> bool:
    """Whether no further fit is to be begun."""
    deadline, most = _end.get()
    return monotonic() > deadline or iterations_made() > most


def limit_text(seconds: float | None) -> str:
    return f"{LONGEST_SEARCH} iterations" if seconds is None else f"{seconds:g} s"
