"""A ball against a wall, F = k X^1.5 (Hertz 1881), which no effect of the vocabulary is: simulated in steps of 5 us."""

import numpy as np

from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.structure import Body, Coefficient, Element, Structure
from crash_replay.recording import Channel, Recording, Test

MASS, SPEED, STIFFNESS = 2.0, 2.0, 4e5  # kg, m/s, N/m^1.5


def impact() -> Recording:
    """30 ms, and 30 ms before it, at 20 kHz; noise of 0.5 % of the peaks."""
    step, every, force, x, v = 5e-6, 10, [], 0.0, SPEED
    for k in range(6000):
        pushed = STIFFNESS * max(x, 0.0) ** 1.5
        if k % every == 0:
            force.append(pushed)
        v -= step * pushed / MASS
        x += step * v
    felt = np.concatenate([np.zeros(600), force])
    clean = np.column_stack([-felt / MASS, felt])
    noise = np.random.default_rng(0).normal(0.0, 0.005, clean.shape) * np.abs(clean).max(axis=0)
    channels = Channel("ball_ax", "acceleration", "ball", "x"), Channel("wall_fx", "force", "wall", "x")
    time_ns = (np.arange(len(felt)) - 600) * 50_000
    return Recording(Test("ball", channels, initial_velocity={"ball": SPEED}), time_ns, clean + noise)


def test_of_two_laws_that_leave_more_than_noise_alike_the_other_is_named():
    """A stop 7 mm on, which does not exist, leaves less than 1 % of the peak, and a cubic spring hardly more."""
    spring = Coefficient(4e4, estimated=True, min=0.0, shape="constant")
    bodies = Body("ball", MASS, ("ball_ax",)), Body("wall", fixed=True, force="wall_fx")
    model = Structure("ball", bodies, (Element("skin", ("ball", "wall"), spring, Coefficient(), tension=False),))
    found = diagnose(model, [impact()])
    first, second, *_ = found.ranking
    assert {first.effect, second.effect} == {"bottoming_out", "cubic_stiffness"} and not found.noise
    assert second.name in first.confounded_with and not first.identifiable
    assert abs(first.evidence - second.evidence) > 10.0
    assert f"cannot be told from {second.name}" in found.text
