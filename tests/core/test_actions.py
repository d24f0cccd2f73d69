"""What an error of a channel makes of an equation is that equation as the channel records it, and linear in theta."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from crash_estimator.core.actions import Actions, _adds_mass, beside_the_springs
from crash_estimator.core.contact import SpringLaw
from crash_estimator.core.kinematics import Motion

THETA = np.array([3.0, -2.0, 0.1])
KNOWN, GRADIENT = np.array([5.0, 7.0]), np.array([[1.0, 0.5, 0.0], [0.3, 2.0, 0.0]])


def recorded(kind: str, share: float, theta: np.ndarray):
    """Of the second equation, whose channel's error is the third parameter."""
    action = SimpleNamespace(kind=kind, share=share, at=4)
    gradient = GRADIENT.copy()
    actions = SimpleNamespace(actions=[action], first=2, row={4: 1})
    known, factor = Actions._recorded(actions, 0, KNOWN, gradient, np.ones(2), theta)
    return known, gradient, factor


@pytest.mark.parametrize("share", [1.0, 0.4])
@pytest.mark.parametrize("kind", ["gain", "offset"])
def test_an_error_of_a_channel_is_in_what_is_predicted_of_it(kind, share):
    """y' = (1 + share e) y, or y + share e, with the derivatives of that by every parameter."""

    def law(theta):
        true = KNOWN[1] + GRADIENT[1] @ theta
        return (1.0 + share * theta[2]) * true if kind == "gain" else true + share * theta[2]

    known, gradient, factor = recorded(kind, share, THETA)
    assert_allclose(known[1] + gradient[1] @ THETA, law(THETA))
    slopes = [(law(THETA + step) - law(THETA - step)) / 2e-4 for step in 1e-4 * np.eye(3)]
    assert_allclose(gradient[1], slopes, rtol=1e-9)
    assert factor[1] == pytest.approx(1.0 + share * THETA[2] if kind == "gain" else 1.0)
    assert (known[0], *gradient[0]) == (KNOWN[0], *GRADIENT[0]), "the other equation is as it was"


def corrected(kind: str, share: float, error: float, time: float, motion: Motion, start) -> Motion:
    """Of two bodies and the element between them; the first one's channel errs."""
    actions = SimpleNamespace(
        actions=[SimpleNamespace(kind=kind, share=share, at=0)], of_channels=[0], first=1, mass=[10.0, 20.0],
        moves=[True, True], measured_crush=np.array([False]), ends=np.array([[0, 1]]),
    )  # fmt: skip
    return Actions.corrected(actions, motion._replace(time=time), np.array([1e5, error]), start)


@pytest.mark.parametrize("share", [1.0, 0.4])
@pytest.mark.parametrize("kind", ["gain", "offset"])
def test_the_motion_without_a_channel_s_error_is_integrated_from_what_it_should_have_recorded(kind, share):
    """A constant acceleration a from x0 with v0: x = x0 + v0 t + a t^2 / 2, and a is wrong by the error's share."""
    time, recorded_a, error = 0.03, -400.0, 0.08 if kind == "gain" else 25.0
    x0, v0 = np.array([0.2, 0.0]), np.array([13.0, 0.0])

    def moved(a):
        return x0 + v0 * time + 0.5 * a * time**2, v0 + a * time, a

    def crush(x, v):
        return x[[0]] - x[[1]], v[[0]] - v[[1]]

    def motion_of(a):
        x, v, a = moved(np.array([a, 0.0]))
        return Motion(time, 1e-3, x, v, a, *crush(x, v), *np.zeros((3, 2)), np.zeros((2, 2)), np.zeros(2))

    def true(error):
        a = recorded_a / (1.0 + error) if kind == "gain" else recorded_a - error
        return recorded_a + share * (a - recorded_a)

    found = corrected(kind, share, error, time, motion_of(recorded_a), (x0, v0))
    expected = motion_of(true(error))
    for name in ("displacement", "velocity", "acceleration", "crush", "rate"):
        assert_allclose(getattr(found, name), getattr(expected, name), rtol=1e-12, err_msg=name)
    step = 1e-5 * error
    ahead, behind = motion_of(true(error + step)), motion_of(true(error - step))
    for of, by in (("displacement", found.displacement_by), ("velocity", found.velocity_by)):
        slope = (getattr(ahead, of) - getattr(behind, of)) / (2.0 * step)
        assert_allclose(by[:, 0], slope, rtol=1e-6, atol=1e-12)
    before = motion_of(recorded_a)._replace(time=-0.01)
    assert corrected(kind, share, error, -0.01, before, (x0, v0)).displacement is before.displacement


@pytest.mark.parametrize("carries", [True, False])
def test_a_force_beside_a_spring_acts_where_the_element_carries(carries):
    action = SimpleNamespace(kind="element", at=0, element=0, in_curve=False, force=lambda motion: 7.0 * motion.rate)
    actions = SimpleNamespace(actions=[action], ends=np.array([[0, 1]]), outlasts=[False])
    none = np.zeros(1)
    law = SpringLaw(none, none, np.array([carries]), np.array([True]), np.array([False]), none, none)
    motion = SimpleNamespace(time=0.01, crush=np.array([0.1]), rate=np.array([2.0]))
    assert Actions.forces(actions, motion, law, none) == [[14.0 if carries else 0.0]]


def test_a_mass_that_an_estimate_would_take_away_leaves_a_twentieth():
    """Of 10 kg, of which 12 are taken: 0.5 kg are left, and the same force moves them twenty times as much."""
    mass = SimpleNamespace(kind="mass", at=0, coefficient=SimpleNamespace(estimated=True))
    actions = SimpleNamespace(actions=[mass], first=1, mass=[10.0])
    gradient = np.array([3.0, 0.0])
    for change, factor in ((-12.0, 20.0), (-5.0, 2.0), (10.0, 0.5)):
        found = Actions._heavier(actions, 0, 4.0, gradient.copy(), np.array([2.0, change]))
        assert found[1] == pytest.approx(factor)


@pytest.mark.parametrize(
    ("kind", "body", "lighter", "estimated", "share"),
    [
        ("mass", 1, -1, True, 1.0),
        ("mass", 0, -1, True, 0.0),
        ("inertia", 0, 1, True, -1.0),
        ("offset", 1, -1, True, 0.0),
        ("mass", 1, -1, False, 0.0),
    ],
)
def test_what_a_coefficient_adds_to_a_body_s_mass(kind, body, lighter, estimated, share):
    action = SimpleNamespace(kind=kind, at=body, lighter=lighter, coefficient=SimpleNamespace(estimated=estimated))
    assert _adds_mass(action, 1) == share


def test_forces_beside_a_spring_add_up_and_factors_multiply():
    def action(kind, value, element=0):
        return SimpleNamespace(kind=kind, at=element, in_curve=False, force=lambda motion: np.full(3, value))

    actions = [action("element", 5.0), action("element", 7.0, element=1), action("factor", 0.5), action("memory", 0.0)]
    structure = SimpleNamespace(elements=[SimpleNamespace(factor=None)] * 2, actions=actions)
    motion = SimpleNamespace(crush=np.ones(3), rate=np.ones(3))
    remembered = np.array([0.0, 0.0, 0.0, 0.25])
    parallel, factor = beside_the_springs(structure, np.array([2.0, 3.0, 4.0, 8.0]), 0, motion, remembered)
    assert_allclose(parallel, 2.0 * 5.0 + 8.0 * 0.25)
    assert_allclose(factor, 1.0 + 4.0 * 0.5)
