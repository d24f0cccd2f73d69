"""The largest force in each element: of motions whose forces are written down."""

import numpy as np
import pytest

from crash_estimator.core.diagnosis.observation.record import observe
from crash_estimator.core.diagnosis.parameterization.magnitudes import measure_magnitudes
from crash_estimator.core.structure import Body, Coefficient, Element, Structure
from crash_replay.recording import Channel, Recording, Test

TIME = np.arange(-200, 801) * 1e-4
PULSE = np.where((TIME > 0.0) & (TIME < 0.06), np.sin(np.pi * TIME / 0.06), 0.0)
MASS = {"impactor": 100.0, "platen": 5.0, "engine": 40.0}
OPEN = Coefficient(1e5, True)


def structure(pairs: dict[str, tuple[str, str]], bodies: dict[str, dict]) -> Structure:
    elements = tuple(Element(name, between, OPEN, tension=False) for name, between in pairs.items())
    return Structure("chain", tuple(Body(name, **what) for name, what in bodies.items()), elements)


def recording(accelerations: dict[str, np.ndarray], force: np.ndarray | None) -> Recording:
    rng = np.random.default_rng(7)
    columns = {f"{name}_ax": a + rng.normal(0.0, 1.0, len(TIME)) for name, a in accelerations.items()}
    channels = [Channel(name, "acceleration", name[:-3], "x") for name in columns]
    if force is not None:
        columns["base_fx"] = force + rng.normal(0.0, 100.0, len(TIME))
        channels.append(Channel("base_fx", "force", "base", "x"))
    test = Test("chain", tuple(channels), initial_velocity={"impactor": 5.0})
    return Recording(test, (TIME * 1e9).round().astype(np.int64), np.stack(list(columns.values()), axis=1))


def free(name: str, **what) -> dict:
    return {"mass": MASS[name], "acceleration": (f"{name}_ax",)} | what


def largest(model: Structure, found: Recording) -> dict[str, float]:
    magnitudes = measure_magnitudes(model, [observe(model, found)])
    return dict(zip((element.name for element in model.elements), magnitudes.force, strict=True))


def test_a_light_body_between_two_elements_tells_neither_force():
    """A specimen on a platen on a load cell: the platen feels a tenth of either."""
    specimen, cell = 3e4 * PULSE, 3e4 * PULSE * (1.0 - 0.1 * PULSE)
    model = structure(
        {"specimen": ("impactor", "platen"), "cell": ("platen", "base")},
        {"impactor": free("impactor"), "platen": free("platen"), "base": {"fixed": True, "force": "base_fx"}},
    )
    found = largest(model, recording({"impactor": -specimen / 100.0, "platen": (specimen - cell) / 5.0}, cell))
    assert found["specimen"] == pytest.approx(3e4, rel=0.02) and found["cell"] == pytest.approx(cell.max(), rel=0.02)


@pytest.mark.parametrize("sensor", [True, False])
def test_behind_a_wall_without_a_load_cell_the_force_is_what_all_bodies_before_it_are_stopped_by(sensor):
    """In the middle it is the impactor's; and without the wall's force, the sum of all inertias at its element."""
    first, second, wall = 2e4 * PULSE, 1.5e4 * PULSE, 2.4e4 * PULSE
    model = structure(
        {"first": ("impactor", "platen"), "second": ("platen", "engine"), "wall": ("engine", "base")},
        {name: free(name) for name in ("impactor", "platen", "engine")}
        | {"base": {"fixed": True, "force": "base_fx" if sensor else None}},
    )
    motion = {"impactor": -first / 100.0, "platen": (first - second) / 5.0, "engine": (second - wall) / 40.0}
    found = largest(model, recording(motion, wall if sensor else None))
    assert {name: pytest.approx(force, rel=0.02) for name, force in found.items()} == {
        "first": 2e4, "second": 1.5e4, "wall": 2.4e4,
    }  # fmt: skip


def test_in_a_loop_it_is_that_of_the_fewest_elements_that_must_be_cut_with_it():
    """Rails and mounts carry what stops the cabin, whatever the light beam before them feels."""
    rails, mounts, radiator, face = 2e4 * PULSE, 0.5e4 * PULSE, 0.8e4 * PULSE, 2.85e4 * PULSE
    bodies = {
        "impactor": free("impactor"), "engine": free("engine"), "platen": free("platen"),
        "base": {"fixed": True, "force": "base_fx"},
    }  # fmt: skip
    pairs = {
        "rails": ("impactor", "platen"), "mounts": ("impactor", "engine"), "radiator": ("engine", "platen"),
        "face": ("platen", "base"),
    }  # fmt: skip
    motion = {
        "impactor": -(rails + mounts) / 100.0, "engine": (mounts - radiator) / 40.0,
        "platen": (rails + radiator - face) / 5.0,
    }  # fmt: skip
    found = largest(structure(pairs, bodies), recording(motion, face))
    assert found["rails"] == pytest.approx(2.5e4, rel=0.02)  # with the mounts
    assert found["mounts"] == found["radiator"] == pytest.approx(3e3, rel=0.1)  # what the engine feels of both
    assert found["face"] == pytest.approx(2.85e4, rel=0.02)


def test_elements_side_by_side_count_as_one_and_a_carried_body_as_its_carrier():
    force = 2e4 * PULSE
    model = structure(
        {"left": ("impactor", "engine"), "right": ("impactor", "engine"), "seat": ("pan", "platen")},
        {
            "impactor": free("impactor"),
            "engine": free("engine"),
            "platen": free("platen"),
            "pan": {"acceleration": ("engine_ax",), "driven": True, "carried_by": "engine"},
        },  # fmt: skip
    )
    motion = {"impactor": -force / 100.0, "platen": 0.1 * force / 5.0, "engine": 0.9 * force / 40.0}
    found = largest(model, recording(motion, None))
    assert found["left"] == found["right"] == pytest.approx(2e4, rel=0.02)
    assert found["seat"] == pytest.approx(2e3, rel=0.05)
