"""The model that `estimator` follows a test with, its method and settings."""

from collections.abc import Sequence

import numpy as np

from crash_replay.recording import Channel, Test

from ..cli.common import parse_settings
from ..core.effects import EFFECTS
from ..core.effects.user import load_effects
from ..core.methods import AnyEstimator, make_estimator
from ..core.structure import Structure
from ..following.follower import Follower
from ..kept import Kept, Rows
from ..model_file import load_model


class EstimatorModel:
    def __init__(self, model: str, method: str, settings: Sequence[str], effects: str, effective_mass: bool):
        """The node's parameters. Raises ModelError with one line."""
        self.method, self.settings = method, parse_settings([pair for pair in settings if pair])
        if effective_mass:
            self.settings["effective_mass"] = True
        self.known_effects = EFFECTS | (load_effects(effects) if effects else {})
        self.structure, self.revision = load_model(model, self.known_effects), 0
        self.try_out(self.structure)

    def estimator(self, structure: Structure, test: Test) -> AnyEstimator:
        return make_estimator(structure, test, self.method, effects=self.known_effects, **self.settings)

    def try_out(self, structure: Structure) -> None:
        """One sample of a test that has just the model's channels: what is wrong with model or method shows now.

        It also gets the compiled code ready before the subscription that a replay waits for.
        """
        channels = {name: Channel(name, quantity) for _, name, quantity in structure.channels()}
        test = Test("try-out", tuple(channels.values()))
        rows = Rows(0, np.zeros(1, dtype=np.int64), np.zeros((1, len(channels))))
        follower = Follower(self.estimator(structure, test), Kept(test))
        follower.keep(rows)
        follower.follow(rows)

    def revise(self, structure: Structure) -> None:
        self.structure, self.revision = structure, self.revision + 1

    def effects(self) -> list[str]:
        """Those that the model has got, as they are said."""
        return [f"{spec.type} on {spec.target}" for spec in self.structure.effects]
