"""Effects hidden by the independent generator, and what an estimator says of them."""

from functools import cache

from scipy.constants import g as G

from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.change import add_effect
from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.model_file import ModelFile
from crash_replay.recording import Recording
from crash_replay.synthetic.hidden.cases import HiddenCase, draw_case

SEED, RATE, NOISE = 3, 2000.0, 0.5  # Hz, g: one draw of each, taken as it came
SENSOR = {"m/s^2": NOISE * G, "N": 3000.0}
"""Standard deviation of what the generator adds; the force's is that of its barrier."""


STRUCTURE = {"load_path": "dummy", "unmodelled_body": "single"}
"""Where each effect is hidden, if not in `frontal`: its bodies are all joined, none of them has a stop."""


@cache
def drawn(effect: str, structure: str, seed: int = SEED) -> HiddenCase:
    return draw_case(structure, [effect], seed)


@cache
def hidden(effect: str, structure: str, seed: int = SEED):
    """-> the model without the effect, what was hidden, the recording, and whom it concerns besides its target."""
    case = drawn(effect, structure, seed)
    recording, _ = case.record(1.0, NOISE, RATE)
    model = ModelFile.model_validate(dict(case.specimen.model)).structure()
    more = {}
    if effect == "unmodelled_body":
        more = {"host": case.specimen.host, "touches": case.specimen.stop[0] if case.specimen.stop else None}
    return model, case.hidden[0], recording, more


def with_it(effect: str, structure: str, coefficient: float | None, seed: int = SEED):
    model, what, recording, more = hidden(effect, structure, seed)
    return add_effect(model, effect, what.target, EFFECTS, recording.test, coefficient, what.shape, **more)


def place_of(effect: str) -> str:
    return STRUCTURE.get(effect, "frontal")


def last_of(structure, recording: Recording, method: str = "constrained_kalman", **settings):
    """-> name -> (value, std, status) after the last sample."""
    estimator = make_estimator(structure, recording.test, method, **settings)
    last = run(estimator, recording.samples())[-1]
    return {
        n: found
        for n, *found in zip(estimator.description.parameters, last.parameters, last.std, last.status, strict=True)
    }


def parameter_of(effect: str, target: str) -> str:
    """A load path and an unloading line are parts of an element already; the others bring a parameter of their own."""
    return target + {"load_path": ".stiffness", "plastic_unloading": ".unloading"}.get(effect, f".{effect}")
