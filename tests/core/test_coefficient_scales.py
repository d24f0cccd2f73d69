"""The scale of a coefficient, by which a filter is started and walks, is what the effect is worth beside its spring."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.applied import applied
from crash_estimator.core.effects.base import ElementForce
from crash_estimator.core.effects.change import add_effect
from crash_estimator.core.effects.estimator_model import typical_motion
from crash_estimator.core.effects.kinds.element_force import ROUGHLY
from crash_estimator.model_file import load_model
from crash_replay.synthetic.recordings import simulate_recording


@pytest.mark.parametrize("name", [name for name, effect in EFFECTS.items() if isinstance(effect, ElementForce)])
def test_a_force_beside_a_spring_is_as_large_as_a_share_of_the_springs(name):
    recording, _ = simulate_recording("frontal_single")
    effect, model = EFFECTS[name], load_model("frontal_single")
    shape = {key: value.starts[0] for key, value in effect.shapes_of("").items()}
    target = (model.elements if effect.acts_on == "element" else model.bodies)[0].name
    structure = applied(add_effect(model, name, target, shape=shape), recording.test)
    (action,) = structure.actions
    typical = typical_motion(model, 0)
    force = np.abs(effect.force(typical, **shape))
    assert_allclose(action.scale * force[force > 0.0][0], ROUGHLY * typical.static[0])
