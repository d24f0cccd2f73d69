"""`python -m crash_estimator.core.compiled.warm_up`: compile the recursion into the cache: no one waits for it."""

import numpy as np

from crash_replay.recording import Channel, Test

from ..methods import make_estimator
from ..structure import Body, Coefficient, Element, Structure


def main() -> None:
    test = Test("warm-up", (Channel("block_ax", "acceleration"),), initial_velocity={"block": 1.0})
    structure = Structure(
        "warm-up",
        (Body("block", 1.0, ("block_ax",)), Body("wall", fixed=True)),
        (Element("spring", ("block", "wall"), Coefficient(1.0, estimated=True)),),
    )
    for method in ("constrained_kalman", "mrls"):
        estimator = make_estimator(structure, test, method)
        estimator.follow(estimator.init(), np.arange(3, dtype=np.int64) * 1_000_000, -np.ones((3, 1)))


if __name__ == "__main__":
    main()
