"""A body on a spring and a damper, on a table that is shaken at random: simulated in steps of 50 us, 1 s at 2 kHz.

Its own ringing amplifies what the table's sensor errs by, which is no effect. Of seeds 0 to 11 three were told one and
one was unexplained, while only slow errors of that sensor were known: those are here.
"""

import numpy as np
import pytest

from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.structure import Body, Coefficient, Element, Structure
from crash_replay.recording import Channel, Recording, Test

STIFFNESS, DAMPING, STEP, EVERY = 1e4, 8.0, 5e-5, 10  # of a body of 1 kg: it rings with 16 Hz


def shaken(seed: int) -> Recording:
    """Both sensors err by 0.5 % of their peaks; 30 ms of rest before."""
    rng, time, frequencies = np.random.default_rng(seed), np.arange(0.0, 1.0, STEP), np.arange(3, 60)
    phases = 2.0 * np.pi * np.outer(time, frequencies) + rng.uniform(0.0, 2.0 * np.pi, len(frequencies))
    table = np.cos(phases).sum(axis=1) * np.minimum(time / 0.05, 1.0)
    x, v, felt = 0.0, 0.0, []  # relative to the table
    for a in table:
        felt.append(-STIFFNESS * x - DAMPING * v)
        v += STEP * (felt[-1] - a)
        x += STEP * v
    clean = np.column_stack([np.concatenate([np.zeros(60), one[::EVERY]]) for one in (table, np.array(felt))])
    noise = rng.normal(0.0, 0.005, clean.shape) * np.abs(clean).max(axis=0)
    channels = Channel("table_ax", "acceleration", "table", "x"), Channel("body_ax", "acceleration", "body", "x")
    return Recording(Test("shaken", channels), (np.arange(len(clean)) - 60) * 500_000, clean + noise)


@pytest.mark.parametrize("seed", [0, 3, 4, 8])
def test_nothing_is_told_where_nothing_is_missing(seed):
    stiffness, damping = (Coefficient(c, estimated=True, min=0.0, shape="constant") for c in (STIFFNESS, DAMPING))
    bodies = Body("body", 1.0, ("body_ax",)), Body("table", acceleration=("table_ax",), driven=True)
    model = Structure("shaken", bodies, (Element("spring", ("table", "body"), stiffness, damping),))
    found = diagnose(model, [shaken(seed)])
    assert found.verdict == "adequate" and not found.steps, found.text
