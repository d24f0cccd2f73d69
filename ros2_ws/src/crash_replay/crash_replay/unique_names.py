"""Channel names that are told apart: a second channel of the same name gets `_2` and so on."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from .recording import Channel


def unique(channels: Sequence[Channel]) -> tuple[Channel, ...]:
    """The channels in their order, each with a name of its own."""
    taken: Counter[str] = Counter()
    told_apart = []
    for channel in channels:
        taken[channel.name] += 1
        number = taken[channel.name]
        told_apart.append(channel if number == 1 else replace(channel, name=f"{channel.name}_{number}"))
    return tuple(told_apart)
