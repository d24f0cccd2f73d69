"""Simulated recordings that several tests look at, each made once, and the command that makes them."""

from functools import cache

from ruamel.yaml import YAML

from crash_replay.synthesize_command import main
from crash_replay.synthetic.hidden.cases import HiddenCase, draw_case
from crash_replay.synthetic.recordings import SCENARIOS

SEED = 11

ideal = cache(lambda name: SCENARIOS[name](ideal=True))
bundled = cache(lambda name: SCENARIOS[name]())


@cache
def drawn(structure: str, *effects: str, seed: int = SEED, size: float = 1.0, at: str = "") -> HiddenCase:
    """at: the target of the only effect, where it is not to be drawn."""
    return draw_case(structure, effects, seed, size, dict.fromkeys(effects, at) if at else None)


@cache
def recorded(structure: str, *effects: str, at: str = ""):
    """-> recording and truth at 1.1 of the nominal speed, and the truth file read back."""
    case = drawn(structure, *effects, at=at)
    recording, truth = case.record(1.1)
    return recording, truth, YAML(typ="safe", pure=True).load(case.truth_text(truth))


def model_of(case: HiddenCase) -> dict:
    return YAML(typ="safe", pure=True).load(case.model_text)


def synthesize(monkeypatch, *arguments: str) -> int:
    """The command's exit status."""
    monkeypatch.setattr("sys.argv", ["synthesize", *arguments])
    try:
        return main()
    except SystemExit as ended:  # usage
        return ended.code
