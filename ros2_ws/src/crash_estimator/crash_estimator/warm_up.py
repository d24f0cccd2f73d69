"""`python -m crash_estimator.warm_up`: compile all that is compiled into the cache, so that no first start waits for
it."""

import sys
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context

from crash_replay.fault import guarded
from crash_replay.said import say
from crash_replay.starting import begin, held
from crash_replay.synthetic.recordings import simulate_recording

from .core.compiled.estimator import CompiledEstimator
from .core.diagnosis import diagnose
from .core.effects import EFFECTS
from .core.methods import make_estimator
from .model_file import load_model

MODEL = "frontal_single"
"""A ready model and the simulated recording of that name."""


def estimate() -> None:
    """All compiled methods are settings of the same functions."""
    recording, _ = simulate_recording(MODEL)
    estimator = make_estimator(load_model(MODEL), recording.test, "mrls")
    assert isinstance(estimator, CompiledEstimator)
    estimator.follow(estimator.init(), recording.time_ns[:3], recording.values[:3])


def answer() -> None:
    """The ranking while samples come takes the same functions."""
    recording, _ = simulate_recording(MODEL)
    diagnose(load_model(MODEL), [recording], EFFECTS)


STEPS: Mapping[str, Callable[[], None]] = {"estimators": estimate, "diagnosis": answer}
"""Side by side, each on a core: they have no compiled function in common."""


def timed(step: str) -> float:
    """s that it takes."""
    began = time.monotonic()
    STEPS[step]()
    return time.monotonic() - began


def main() -> int:
    return guarded(_main)


def _main() -> int:
    """A line on each step when it is done -> exit status 1 where one has failed: it is compiled when it is used."""
    failed = 0
    with ProcessPoolExecutor(len(STEPS), mp_context=get_context("spawn"), initializer=begin) as pool:
        with held():
            steps = {pool.submit(timed, step): step for step in STEPS}
        for number, future in enumerate(as_completed(steps), 1):
            error = future.exception()
            failed += error is not None
            how = f"failed: {error}" if error else f"{future.result():.0f} s"
            say(f"compiled {number} of {len(steps)}: {steps[future]}, {how}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
