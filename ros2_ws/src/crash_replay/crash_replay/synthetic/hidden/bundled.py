"""The recording in bags/ whose model lacks an effect: a dummy with friction between rib and spine."""

from ..recordings import BUNDLED_SEED
from .cases import HiddenCase, draw_case

NAME = "hidden_effect"


def bundled_case() -> HiddenCase:
    return draw_case("dummy", ["coulomb_friction"], BUNDLED_SEED, at={"coulomb_friction": "rib_spine"})
