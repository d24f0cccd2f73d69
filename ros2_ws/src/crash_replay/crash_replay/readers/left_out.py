"""What an import has left out, and why, in notes that stay short however much it is.

A note is `left out, REASON: WHAT`; the command `import` makes a table of them.
"""

from collections.abc import Sequence

MARK = "left out, "
MOST_RANGES = 12


def summary(why: str, curves: Sequence[int], besides: str = "") -> str:
    """The note for one reason."""
    parts = [f"curves {ranges(curves)}"] if curves else []
    return f"{MARK}{why}: {' and '.join([*parts, *([besides] if besides else [])])}"


def ranges(numbers: Sequence[int]) -> str:
    """1, 2, 3, 7 -> "1-3, 7"."""
    runs: list[list[int]] = []
    for number in sorted(numbers):
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    shown = [str(run[0]) if len(run) == 1 else f"{run[0]}-{run[-1]}" for run in runs]
    if len(shown) <= MOST_RANGES:
        return ", ".join(shown)
    rest = sum(map(len, runs[MOST_RANGES - 1 :]))
    return f"{', '.join(shown[: MOST_RANGES - 1])} and {rest} more"
