"""How a replay fares: whether it keeps the rate that it is asked for, now, and whom it has lost."""

from .attendance import State
from .audience import Audience
from .health import Health, Level
from .pacing import Pacing
from .player import NOW, Mode

KEPT = 0.95
"""Share of the rate asked for that counts as kept."""


def replay_health(pacing: Pacing, audience: Audience) -> Health:
    player, tally = pacing.player, pacing.tally
    rate, states = pacing.rate_now(), dict(audience.states)
    values = {
        "rate asked for": player.rate,
        "rate kept": rate,
        "late by, ms": pacing.late() * 1e3,
        "late by at worst, ms": tally.worst_lateness * 1e3,
        "run": player.run,
        "next sample": player.next,
        "samples of the test": len(player.time_ns),
        "samples sent": tally.samples,
        "samples in a message": pacing.block,
        **{f"listener {name}": state.name.lower() for name, state in sorted(states.items())},
    }
    level, message = Level.OK, player.mode.name.lower()
    if player.mode == Mode.PLAYING and tally.took > NOW and rate < KEPT * player.rate:
        level, message = Level.WARN, f"keeps a rate of {rate:.4g}, {player.rate:g} is asked for"
    for state, of_it in ((State.SILENT, Level.WARN), (State.KILLED, Level.ERROR)):
        if names := [name for name, its in sorted(states.items()) if its == state]:
            level, message = of_it, f"{', '.join(names)}: {state.name.lower()}"
    return Health(level, message, values, pacing.recording.test.id)
