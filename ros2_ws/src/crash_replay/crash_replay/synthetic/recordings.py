"""The table of scenarios, and the recordings made of them."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

from ..recording import Recording
from .dummy import side_dummy_padded, side_dummy_unpadded
from .frontal import frontal_abrupt, frontal_engine_cab, frontal_single
from .impactor import impactor_single
from .scenario import Scenario, Truth, record
from .side import side_abrupt, side_mdb_door_car

BUNDLED_SEED = 1
"""Of the recordings in bags/."""

BUILDERS: Mapping[str, Callable[[], Scenario]] = {
    build.__name__: build
    for build in (
        frontal_single,
        frontal_engine_cab,
        frontal_abrupt,
        side_mdb_door_car,
        side_abrupt,
        side_dummy_padded,
        side_dummy_unpadded,
        impactor_single,
    )
}


def simulate_recording(
    name: str,
    seed: int = BUNDLED_SEED,
    *,
    rate: float | None = None,
    noise: float | None = None,
    speed: float = 1.0,
    ideal: bool = False,
) -> tuple[Recording, Truth]:
    """The scenario `name` recorded; the same arguments give the same numbers, bit for bit.

    rate in Hz and noise (standard deviation of the accelerometers) in g instead of the scenario's;
    speed as a multiple of the scenario's; ideal: sensors without noise, offset or quantisation.
    """
    scenario = BUILDERS[name]().at_speed(speed)
    if rate is not None:
        scenario = replace(scenario, rate=rate)
    if noise is not None:
        scenario = scenario.with_noise(noise)
    return record(scenario.ideal() if ideal else scenario, seed)


SCENARIOS: Mapping[str, Callable[..., tuple[Recording, Truth]]] = {
    name: partial(simulate_recording, name) for name in BUILDERS
}
"""name -> function(seed, rate=, noise=, speed=, ideal=) -> (Recording, Truth)"""
