"""A car with a mass that hangs in it and no sensor on that, thrown at a barrier; simulated by scipy's integrator."""

import numpy as np
import yaml
from scipy.constants import g as G
from scipy.integrate import solve_ivp

from crash_estimator.core.structure import Structure
from crash_estimator.model_file import ModelFile
from crash_replay.recording import Channel, Recording, Test

CAR, ENGINE = 900.0, 250.0  # kg
FRONT, FRONT_DAMPING = 8.0e5, 4000.0  # N/m, N s/m
FREQUENCY, DAMPING = 22.0, 0.08  # Hz and ratio, of the engine on its mounts while the car is held
MODEL = f"""
name: car
bodies:
  car: {{mass: {CAR}, acceleration: car_ax}}
  barrier: {{fixed: true, force: barrier_fx}}
elements:
  front:
    between: [car, barrier]
    tension: none
    stiffness: {{estimate: true, initial: 500000.0, shape: constant}}
    damping: {FRONT_DAMPING}
"""


def hung_model(more: str = "") -> Structure:
    return ModelFile.model_validate(yaml.safe_load(MODEL + more)).structure()


def crash(speed: float, seed: int, engine: float = ENGINE, noise: float = 0.3, rate: float = 5000.0) -> Recording:
    """150 ms from 30 ms before the impact; noise: g on the car, and kN on the barrier; rate in Hz."""
    w = 2.0 * np.pi * FREQUENCY

    def force(state):
        return max(FRONT * state[0] + FRONT_DAMPING * state[2], 0.0) if state[0] > 0.0 else 0.0

    def slope(t, state):
        x, y, v, u = state
        mount = w * w * (x - y) + 2.0 * DAMPING * w * (v - u)  # N for each kg of the engine
        return v, u, -(force(state) + engine * mount) / CAR, mount

    time, before = np.arange(0.0, 0.12, 1.0 / rate), round(0.03 * rate)
    states = solve_ivp(slope, (0.0, time[-1]), (0.0, 0.0, speed, speed), "LSODA", time, rtol=1e-9, atol=1e-10).y.T
    true = np.array([(slope(0.0, state)[2], force(state)) for state in states])
    values = np.concatenate([np.zeros((before, 2)), true])
    values += np.random.default_rng(seed).normal(0.0, noise, values.shape) * [G, 1000.0]
    channels = Channel("car_ax", "acceleration", "car"), Channel("barrier_fx", "force", "barrier")
    time_ns = np.rint(np.arange(-before, len(time)) * 1e9 / rate).astype(np.int64)
    return Recording(Test(f"car {seed}", channels, initial_velocity={"car": speed}), time_ns, values)
