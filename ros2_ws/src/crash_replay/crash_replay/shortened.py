"""Long lists in one line."""

from collections.abc import Sequence

MOST_NAMES = 6


def shortened(names: Sequence[str], most: int = MOST_NAMES) -> str:
    """ "a, b, c and 42 more": enough to know what it is about."""
    if len(names) <= most:
        return ", ".join(names)
    return f"{', '.join(names[: most - 1])} and {len(names) - most + 1} more"
