"""How a model file names the form of an effect."""

import pytest

from crash_estimator.core.effects import EFFECTS
from crash_estimator.model_file import load_model

MODEL = """
name: two
bodies:
  car: {{mass: 1000.0, acceleration: car_ax}}
  engine: {{mass: 300.0, acceleration: engine_ax}}
  wall: {{fixed: true}}
elements:
  front: {{between: [car, wall], stiffness: 1.0e6}}
effects:
  - {{type: load_path, between: [car, engine], {key}: one_way}}
"""


@pytest.mark.parametrize("key", ["form", "variant"])
def test_a_form_is_named_and_files_written_before_are_read(tmp_path, key):
    path = tmp_path / "two.yaml"
    path.write_text(MODEL.format(key=key))
    assert load_model(path).effects[0].variant == "one_way"


def test_an_unknown_form_is_one_line_with_its_place(tmp_path):
    path = tmp_path / "two.yaml"
    path.write_text(MODEL.format(key="form").replace("one_way", "sideways"))
    with pytest.raises(Exception, match=r"two.yaml:10: .*form.*one_way") as caught:
        load_model(path, EFFECTS)
    assert "\n" not in str(caught.value)
