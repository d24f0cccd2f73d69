"""The model that `estimator` follows a test with, its method and settings."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from crash_replay.recording import Channel, Test

from ..core.effects import EFFECTS
from ..core.effects.effect import Effect
from ..core.effects.user import load_effects
from ..core.methods import AnyEstimator, make_estimator
from ..core.structure import Structure
from ..following.follower import Follower
from ..kept import Kept, Rows
from ..model_file import load_model
from .estimator_parameters import settings_in


@dataclass(frozen=True)
class EstimatorModel:
    structure: Structure
    method: str
    settings: Mapping[str, Any]  # of the method, as `make_estimator` takes them
    known_effects: Mapping[str, Effect]
    revision: int = 0  # how often it was changed since the node started

    def estimator(self, test: Test) -> AnyEstimator:
        return make_estimator(self.structure, test, self.method, effects=self.known_effects, **self.settings)

    def try_out(self) -> None:
        """One sample of a test that has just the model's channels: what is wrong with model or method shows now.

        It also gets the compiled code ready before the subscription that a replay waits for.
        """
        channels = {name: Channel(name, quantity) for _, name, quantity in self.structure.channels()}
        test = Test("try-out", tuple(channels.values()))
        rows = Rows(0, np.zeros(1, dtype=np.int64), np.zeros((1, len(channels))))
        follower = Follower(self.estimator(test), Kept(test))
        follower.keep(rows)
        follower.follow(rows)

    def with_structure(self, structure: Structure) -> "EstimatorModel":
        return replace(self, structure=structure, revision=self.revision + 1)

    def with_settings(self, values: Mapping[str, Any]) -> "EstimatorModel":
        """values: of the node's parameters that are settings."""
        return replace(self, settings={**self.settings, **settings_in(values)}, revision=self.revision + 1)

    def effects(self) -> list[str]:
        """Those that the model has got, as they are said."""
        return [f"{spec.type} on {spec.target}" for spec in self.structure.effects]


def model_asked(asked: Mapping[str, Any]) -> EstimatorModel:
    """The one that a node's parameters ask for, tried out. Raises ModelError with one line."""
    known = EFFECTS | (load_effects(asked["effects"]) if asked["effects"] else {})
    settings = settings_in(asked) | ({"effective_mass": True} if asked["effective_mass"] else {})
    model = EstimatorModel(load_model(asked["model"], known), asked["method"], settings, known)
    model.try_out()
    return model
