"""How much has been fitted: work that is the same on every machine, and grows with the samples as its time does."""

from contextvars import ContextVar

_made: ContextVar[int] = ContextVar("iterations", default=0)


def count_iteration() -> None:
    _made.set(_made.get() + 1)


def iterations_made() -> int:
    """Gauss-Newton iterations of all fits so far, each a pass over all recordings."""
    return _made.get()
