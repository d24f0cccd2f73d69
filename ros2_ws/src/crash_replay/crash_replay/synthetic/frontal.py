"""Frontal impacts on a rigid barrier: cab and engine (thesis figure 5.2), and one mass (figure 4.2).

The thesis's stiffness curves are in figures that its text lacks. These change abruptly, as its do: K1, the
structure that goes past the engine, holds, folds and stiffens again; K2, in front of the engine, is
soft until the engine is at the barrier. Both unload along a steep slope, so that the car rebounds. The dampers
act both ways, as in the thesis: after the rebound they pull a little.
"""

from .curves import Curve, constant, stepped
from .forces import Spring
from .scenario import Scenario
from .sensors import Sensor, accelerometer, load_cell_barrier
from .system import Body, Element, System


def frontal_engine_cab() -> Scenario:
    """The masses, K3 and damping of the ready model `frontal_engine_cab`."""
    system = _engine_cab(
        cab=1319.0, engine=400.0, velocity=13.3, damping=(1000.0, 200.0, 1000.0),
        cab_engine=Spring(constant(8.0e5), 5.0e6),
        cab_barrier=stepped((0.0, 8.0e5), (0.12, 4.5e5), (0.30, 3.2e5), (0.50, 4.2e5), width=0.02),
        engine_barrier=stepped((0.0, 1.0e5), (0.36, 4.2e5), (0.48, 3.0e5), width=0.02),
        unloading=1.5e7,
    )  # fmt: skip
    return Scenario(
        "frontal_engine_cab",
        "Simulated frontal impact: cab and engine on a barrier at 13.3 m/s",
        system,
        _sensors(),
        0.14,
    )


def frontal_abrupt() -> Scenario:
    """The thesis's problem of 5.6.1: its masses, K3 and damping; 1 ms sampling.

    Noise is 0.37 of each output's standard deviation. There are no samples before the impact: a mean of few so
    noisy ones would make a worse zero than none.
    """
    system = _engine_cab(
        cab=3000.0, engine=1000.0, velocity=13.3, damping=(1000.0, 1000.0, 1000.0), cab_engine=Spring(constant(1.0e6)),
        cab_barrier=stepped((0.0, 1.4e6), (0.20, 6.0e5), (0.42, 1.0e6)),
        engine_barrier=stepped((0.0, 2.0e5), (0.30, 8.0e5), (0.48, 4.0e5)),
        unloading=3.0e7,
    )  # fmt: skip
    sensors = tuple(Sensor(sensor.channel, sensor.of, noise_share=0.37) for sensor in _sensors())
    return Scenario(
        "frontal_abrupt", "Simulated frontal impact: abrupt stiffness changes, 1 kHz, noise as in the thesis",
        system, sensors, duration=0.12, before=0.0, rate=1000.0,
    )  # fmt: skip


def _engine_cab(
    cab: float, engine: float, velocity: float, damping: tuple[float, float, float], cab_engine: Spring,
    cab_barrier: Curve, engine_barrier: Curve, unloading: float,
) -> System:  # fmt: skip
    c1, c2, c3 = damping
    return System(
        (Body("cab", cab, velocity), Body("engine", engine, velocity), Body("barrier")),
        (
            Element("cab_barrier", ("cab", "barrier"), Spring(cab_barrier, unloading), c1),
            Element("engine_barrier", ("engine", "barrier"), Spring(engine_barrier, unloading), c2),
            Element("cab_engine", ("cab", "engine"), cab_engine, c3),
        ),
    )


def _sensors() -> tuple[Sensor, ...]:
    return (
        accelerometer("car_ax", "cab"),
        accelerometer("engine_ax", "engine"),
        load_cell_barrier("barrier_fx", "barrier"),
    )


def frontal_single() -> Scenario:
    """One mass on a barrier: a force that rises to a plateau, and little rebound."""
    system = System(
        (Body("car", 1719.0, 13.3), Body("barrier")),
        (
            Element(
                "car_barrier",
                ("car", "barrier"),
                Spring(Curve((0.0, 0.1, 0.25, 0.45, 0.65, 0.8), (1.2e6, 1.1e6, 7.5e5, 6.0e5, 5.8e5, 6.5e5)), 2.0e7),
                damping=2000.0,
            ),
        ),
    )
    sensors = accelerometer("car_ax", "car"), load_cell_barrier("barrier_fx", "barrier")
    return Scenario(
        "frontal_single", "Simulated frontal impact: one mass on a barrier at 13.3 m/s", system, sensors, 0.12
    )
