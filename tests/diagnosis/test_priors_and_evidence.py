"""What a fit's priors say before it, and what its evidence counts: against densities written out."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from crash_estimator.core.diagnosis.observation.record import observe
from crash_estimator.core.diagnosis.output_error.gauss_newton import _shorten, solve
from crash_estimator.core.diagnosis.output_error.laplace_evidence import log_prior, posterior
from crash_estimator.core.diagnosis.output_error.normal_equations import Normal
from crash_estimator.core.diagnosis.output_error.problem import embedding
from crash_estimator.core.diagnosis.parameterization.free_curve import ROUGHNESS, Curve, adapted_roughness
from crash_estimator.core.diagnosis.parameterization.layout import _element_link
from crash_estimator.core.diagnosis.parameterization.magnitudes import Magnitudes
from crash_estimator.core.diagnosis.parameterization.nuisances import modes
from crash_estimator.core.diagnosis.parameterization.prior import Builder
from crash_estimator.core.diagnosis.residuals.score_test import _statistic
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.base import Shape
from crash_estimator.core.effects.effect import Addition
from crash_estimator.core.effects.kinds.element_force import HALF
from crash_estimator.core.structure import Body, Coefficient, Element, Structure
from crash_replay.recording import Channel, Recording, Test


def layout(std, low, mean):
    std = np.array(std)
    prior = SimpleNamespace(
        precision=np.diag(std**-2), low=np.array(low), high=np.full(len(std), np.inf), mean=np.array(mean)
    )
    return SimpleNamespace(prior=prior, size=len(std))


def test_a_prior_that_ends_at_its_mean_is_twice_as_dense_there():
    """Half a normal, which has the same area; that is what limits away from the mean hardly change."""
    std = (2.0, 0.01, 300.0)
    found = log_prior(layout(std, (-np.inf, 0.0, -5.0), (0.0, 0.0, 0.0)))
    density = 1.0 / (np.sqrt(2.0 * np.pi) * np.array(std)) * [1.0, 2.0, 1.0]
    assert 0.5 * found == pytest.approx(np.log(density * np.sqrt(2.0 * np.pi)).sum())


def test_the_posterior_of_parameters_of_other_units_is_the_inverse_of_their_precision():
    std, correlation = np.array([1e6, 1e-3]), np.array([[1.0, 0.6], [0.6, 1.0]])
    precision = np.linalg.inv(correlation * np.outer(std, std))
    covariance, log_determinant = posterior(precision)
    assert_allclose(covariance, correlation * np.outer(std, std), rtol=1e-9)
    assert log_determinant == pytest.approx(-np.log(np.linalg.det(correlation)) - 2.0 * np.log(std).sum())


def test_a_curve_that_folds_may_fold_again_and_one_that_does_not_gets_stiffer():
    """A Student-t prior: far out its scale is in proportion to the bend, near zero it does not depend on it."""
    knots = np.linspace(0.0, 0.4, 5)
    curve = Curve(knots, np.array([-1, 0, 1, 2, 3]), 0.4, 1e5)

    def roughness(bend):
        slopes = np.array([1.0, 1.0, 1.0 + bend, 1.0 + bend]) * 1e5
        return adapted_roughness(curve, np.cumsum(slopes * np.diff(knots)))

    straight, folded, sharper = roughness(0.0), roughness(1e3), roughness(2e3)
    assert_allclose(straight, straight[0], rtol=1e-9)
    assert straight[0] < ROUGHNESS
    assert folded[1] > 10.0 * ROUGHNESS and sharper[1] == pytest.approx(2.0 * folded[1], rel=1e-3)
    assert_allclose(folded[[0, 2]], straight[[0, 2]], rtol=1e-9)


@pytest.mark.parametrize(("theta", "expected"), [((0.5, 2.0), (-0.5, 1.0)), ((3.0, 2.0), (-2.0, 1.0))])
def test_a_step_ends_at_the_limits_which_count_from_where_it_begins(theta, expected):
    normal = Normal(np.eye(2), np.array([-2.0, 1.0]), 10.0, 4, 0.0)
    of = layout((1e6, 1e6), (0.0, 0.0), (0.0, 0.0))
    assert_allclose(solve(of, normal, np.array(theta)).delta, expected, rtol=1e-6)


def test_a_step_is_shortened_by_its_largest_change_of_a_shape_alone():
    shapes = np.array([1, 2])
    assert _shorten(np.array([1e6, 0.1, -0.2]), shapes) == 1.0
    assert _shorten(np.array([1e6, 0.35, -0.7]), shapes) == pytest.approx(0.5)
    assert _shorten(np.array([1e6, 0.0, 0.0]), shapes) == 1.0
    assert _shorten(np.array([1e6]), np.array([], dtype=int)) == 1.0


def test_the_mean_of_two_sensors_has_an_error_smaller_by_the_root_of_two():
    signal = SimpleNamespace(noise=3.0, offset_std=0.4)
    record = SimpleNamespace(at=np.arange(900), signals={"left": signal, "right": signal})
    builder = Builder()
    found = modes(builder, record, [(0, ("left", "right"), 12)])
    mean, *others = [one.std for one in builder.parameters]
    assert found == {0: range(1 + len(others))} and len(others) == 12
    assert mean == pytest.approx(np.hypot(0.4, 3.0 / 30.0) / np.sqrt(2.0))
    assert others == pytest.approx(np.full(len(others), 3.0 * np.sqrt(2.0 / 900.0) / np.sqrt(2.0)))


@pytest.mark.parametrize(
    ("estimated", "curve", "names"),
    [(True, None, ["spring.stiffness"]), (True, "curve", []), (False, None, []), (False, "curve", [])],
)
def test_a_spring_has_a_constant_only_where_it_is_unknown_and_no_curve(estimated, curve, names):
    element = Element("spring", ("car", "wall"), Coefficient(1e5, estimated=estimated), Coefficient(0.0))
    magnitudes = SimpleNamespace(stiffness=[1e5], force=[1e4], rate=[10.0])
    builder = Builder()
    _element_link(builder, 0, element, {"car": 0, "wall": 1}, curve, magnitudes, (), [])
    assert [one.name for one in builder.parameters] == names


def strained(tension: bool, low: float, high: float) -> Magnitudes:
    """Of one element that has been crushed to `high` m, and stretched to `low`."""
    spring = Element("spring", ("car", "wall"), Coefficient(1e5), tension=tension)
    structure = SimpleNamespace(elements=[spring], body_index={})
    return Magnitudes(structure, (), (), *[None] * 8)._replace(
        crush_range=np.array([[low, high]]), rate=np.array([3.0])
    )


@pytest.mark.parametrize(
    ("tension", "low", "high", "variants"),
    [
        (True, -0.1, 0.1, {"", "play"}), (True, 0.0, 0.1, {""}), (False, -0.1, 0.1, {""}), (False, 0.0, 0.1, {""}),
        (True, -0.1, 0.0, {"play"}), (False, -0.1, 0.0, set()),
    ],
)  # fmt: skip
def test_a_gap_to_both_sides_is_sought_of_an_element_that_can_pull_and_has_been_pulled(tension, low, high, variants):
    found = list(EFFECTS["clearance"].candidates(None, strained(tension, low, high)))
    assert {one.variant for one in found} == variants
    assert all(0.0 < one.coefficient < max(high, -low) for one in found)


@pytest.mark.parametrize(("tension", "sought"), [(True, True), (False, False)])
def test_of_what_is_only_stretched_all_but_the_laws_of_crush_is_sought(tension, sought):
    """The lashing of a load, which no candidate was sought for: a load path beside it was told."""
    lashing = strained(tension, -0.05, 0.0)
    of_elements = {name: effect for name, effect in EFFECTS.items() if effect.acts_on == "element"}
    found = {name: list(effect.candidates(lashing.structure, lashing)) for name, effect in of_elements.items()}
    either_way = {"viscous_damping", "quadratic_damping", "coulomb_friction", "hysteresis", "maxwell_element"}
    assert {name for name, ones in found.items() if ones} >= either_way if sought else not any(found.values())
    assert not any(found[name] for name in ("bottoming_out", "yielding", "plastic_unloading", "gas_cushion"))
    ways = [one.shapes["yield_crush"] for one in found["hysteresis"]]
    assert (
        all(0.001 < way < 0.05 for way in ways)
        and lashing.strained_elements() == list(lashing.structure.elements)[:sought]
    )


def test_a_limiter_may_lose_all_the_stiffness_that_it_had():
    magnitudes = SimpleNamespace(force=[3000.0], element=lambda name: 0)
    limiter = Addition(EFFECTS["yielding"], "belt", {"yield_crush": 0.02})
    assert EFFECTS["yielding"].prior_std(magnitudes, limiter) == HALF * 3000.0 / 0.02


@pytest.mark.parametrize(("tension", "both_ways", "way"), [(True, True, 0.1), (True, False, 0.02), (False, True, 0.02)])
def test_the_way_of_an_element_that_is_stretched_more_than_crushed_is_its_extension(tension, both_ways, way):
    structure = SimpleNamespace(elements=[SimpleNamespace(name="belt", tension=tension)])
    magnitudes = Magnitudes(structure, (), (), *[None] * 8)._replace(crush_range=np.array([[-0.1, 0.02]]))
    assert magnitudes.shape_unit(Shape("m", 0.1, 0.5, (0.2,), of_crush=True, both_ways=both_ways), "belt") == way


def test_a_curve_s_force_at_no_crush_is_no_parameter():
    """Its column there is -1, as everywhere where there is none."""
    curve = Builder().curve("spring", np.array([-0.1, 0.0, 0.1]), 0.1, 1e4, 1.0)
    assert curve.column.tolist() == [0, -1, 1]


@pytest.mark.parametrize("high", [1e-3, 1.0, 1e6])
def test_a_step_does_not_go_beyond_a_limit_by_more_than_rounding(high):
    """Unlimited it would end a hundred-millionth of the limit beyond it."""
    of = SimpleNamespace(
        size=1,
        prior=SimpleNamespace(precision=np.zeros((1, 1)), mean=np.zeros(1), low=-np.ones(1), high=np.array([high])),
    )
    normal = Normal(np.eye(1), np.array([high * (1.0 + 1e-8)]), 10.0, 4, 0.0)
    assert solve(of, normal, np.zeros(1)).delta[0] == high


def test_the_parameters_of_a_model_are_found_among_more_by_their_names():
    base = SimpleNamespace(knots=2, names=["b", "c"], offsets=[])
    wide = SimpleNamespace(knots=3, names=["a", "b", "c"], offsets=[])
    assert embedding(base, wide).tolist() == [0, 1, 4, 5]


def test_only_directions_that_the_model_leaves_are_judged():
    """Of three the first two stand out by 3 and 1 of their standard deviations, the third is the model's own."""
    square, freedom = _statistic(np.array([3.0, 2.0, 5.0]), np.diag([1.0, 4.0, 0.0]))
    assert (square, freedom) == (pytest.approx(3.0**2 + 1.0), 2)


def test_every_acceleration_is_observed_also_one_that_no_body_of_the_model_has():
    """What is mounted in the car may move on its own: its channel is where that is seen."""
    channels = tuple(Channel(name, "acceleration") for name in ("car_ax", "battery_ax")) + (
        Channel("belt_fx", "force"),
    )
    time_ns = np.arange(-30, 60, dtype=np.int64) * 1_000_000
    values = np.random.default_rng(1).standard_normal((90, 3))
    bodies = Body("car", 1000.0, ("car_ax",)), Body("wall", fixed=True)
    model = Structure("car", bodies, (Element("front", ("car", "wall"), Coefficient(1e5)),))
    assert set(observe(model, Recording(Test("t", channels), time_ns, values)).signals) == {"car_ax", "battery_ax"}
