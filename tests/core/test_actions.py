"""What an error of a channel makes of an equation is that equation as the channel records it, and linear in theta."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from crash_estimator.core.actions import Actions

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
