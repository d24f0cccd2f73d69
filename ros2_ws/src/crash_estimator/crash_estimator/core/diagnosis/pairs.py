"""Targets that are two bodies."""

from collections.abc import Mapping


def pair_of(target: str, index: Mapping[str, int]) -> tuple[int, int]:
    """The two bodies of "body_a-body_b"; a name may have hyphens of its own."""
    pairs = [(a, b) for a in index for b in index if f"{a}-{b}" == target]
    return index[pairs[0][0]], index[pairs[0][1]]
