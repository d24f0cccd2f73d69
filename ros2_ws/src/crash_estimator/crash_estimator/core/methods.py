"""The table of estimation methods."""

from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from difflib import get_close_matches
from typing import Any, NamedTuple, Protocol

from crash_replay.recording import Sample, Test

from .effects import EFFECTS
from .effects.applied import applied
from .effects.channels import Corrected, known_errors
from .effects.effect import Effect
from .estimate import Description, Estimate
from .estimator import Estimator, Method
from .estimators import afmm, effective_mass, gauss_newton, kalman, rls
from .estimators.afmm import Afmm
from .estimators.damping_later import DampingLater
from .estimators.effective_mass import EffectiveMass, MassSettings
from .estimators.gauss_newton import GaussNewton
from .estimators.kalman import Kalman
from .estimators.order_bank import OrderBank
from .estimators.rls import Rls
from .estimators.update import theta_settings
from .mass_first import MassFirst
from .structure import ModelError, Structure


def elastic(structure: Structure) -> Structure:
    """The same structure without the unloading lines: for a filter that knows nothing of loading and unloading."""
    elements = tuple(replace(element, unloading=None, unloading_slope=None) for element in structure.elements)
    return replace(structure, elements=elements)


class AnyEstimator(Protocol):
    """What folds samples: `Estimator`, or one with equations of its own."""

    description: Description

    def init(self) -> Any: ...

    def step(self, state: Any, sample: Sample) -> tuple[Any, Estimate]: ...


def _masses(structure: Structure, test: Test, settings: Any, name: str) -> AnyEstimator:
    return EffectiveMass(structure, test, settings)


class Recipe(NamedTuple):
    """How a method is made: its class, where it differs from the class's defaults, and what it takes of a structure."""

    kind: type[Any]
    settings: dict[str, Any] = {}
    structure: Callable[[Structure], Structure] = lambda structure: structure
    estimator: Callable[[Structure, Test, Method, str], AnyEstimator] = Estimator
    thesis: dict[str, Any] = {}  # settings with which it is the recursion that the thesis prints

    def defaults(self, preset: str = "ours") -> dict[str, Any]:
        """Settings that differ from the class's, by preset."""
        return self.settings | (self.thesis if preset == "thesis" else {})


METHODS: dict[str, Recipe] = {
    "rls": Recipe(Rls, thesis=rls.THESIS),
    "mrls": Recipe(Rls, {"m": 5}, thesis=rls.THESIS_MRLS),
    "kalman": Recipe(Kalman, {"constrained": False, "offsets": False}, elastic, thesis=kalman.THESIS),
    "constrained_kalman": Recipe(Kalman, thesis=kalman.THESIS),
    "gauss_newton": Recipe(GaussNewton, thesis=gauss_newton.THESIS),
    "gauss_newton_orders": Recipe(OrderBank, thesis={"printed": True}),
    "afmm": Recipe(Afmm, thesis=afmm.THESIS),
    "effective_mass": Recipe(MassSettings, estimator=_masses, thesis=effective_mass.THESIS),
}
PRESETS = ("ours", "thesis")
"""Sets of settings: our own defaults, and each recursion as the thesis prints it."""


def make_estimator(  # noqa: PLR0913 - everything that an estimator can be told
    structure: Structure,
    test: Test,
    method: str,
    damping_after: float | None = None,
    effective_mass: bool = False,
    compiled: bool = True,
    effects: Mapping[str, Effect] = EFFECTS,
    preset: str = "",
    **settings,
) -> AnyEstimator:
    """An estimator of the structure's parameters (effective_mass: of its masses) on a test's channels.

    method: a key of METHODS; settings: fields of that method's dataclass, such as forgetting=0.98; damping_after: hold
    each damping at its initial value until its element's stiffness is known to this share of its value; effective_mass:
    find the masses first, and the method's parameters with them; compiled: use the compiled form where there is one (it
    agrees with the readable one but for rounding); effects: the table that the structure's effects are in; preset: one
    of PRESETS, what the settings are that are not given; "": the structure's.
    Raises ModelError or RecordingError where the model does not fit the test, or a setting does not exist.
    """
    if method not in METHODS:
        near = get_close_matches(method, METHODS, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise ModelError(f"there is no method {method!r}, only {', '.join(METHODS)}{hint}")
    preset = preset or structure.preset
    if preset not in PRESETS:
        raise ModelError(f"there is no preset {preset!r}, only {', '.join(PRESETS)}")
    errors = known_errors(structure, test, effects)
    if errors is None:
        return _made(structure, test, method, damping_after, effective_mass, compiled, effects, preset, settings)
    applied(structure, test, effects)  # says what is wrong with any of them, before the channels are mended
    left = tuple(e for e in structure.effects if e.coefficient is None or not effects[e.type].only_distorts)
    mended = replace(structure, effects=left)
    inner = _made(mended, test, method, damping_after, effective_mass, compiled, effects, preset, settings)
    return Corrected(inner, errors)


def _made(  # noqa: PLR0913 - likewise
    structure: Structure, test: Test, method: str, damping_after: float | None, effective_mass: bool, compiled: bool,
    effects: Mapping[str, Effect], preset: str, settings: dict[str, Any],
) -> AnyEstimator:  # fmt: skip
    """As `make_estimator`, for samples that are free of the channels' known errors."""
    if effective_mass or method == "effective_mass":
        _check_masses_alone(structure, effects)
    if effective_mass and method != "effective_mass":
        given = METHODS["effective_mass"].defaults(preset)
        masses = EffectiveMass(structure, test, MassSettings(theta_settings(structure), **given))
        return MassFirst(
            structure,
            masses,
            lambda s: _made(s, test, method, damping_after, False, compiled, effects, preset, settings),
        )
    recipe = METHODS[method]
    known = [f.name for f in fields(recipe.kind) if f.init and f.name != "settings"]
    for name in settings:
        if name not in known:
            near = get_close_matches(name, known, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            raise ModelError(f"method {method} has no setting {name!r}, only {', '.join(known)}{hint}")
    structure = applied(recipe.structure(structure), test, effects)
    chosen = recipe.kind(theta_settings(structure), **recipe.defaults(preset) | settings)
    if damping_after is not None and recipe.estimator is Estimator:
        chosen = DampingLater(chosen, damping_after)
    if compiled and structure.first_order and isinstance(chosen, (Rls, Kalman)) and chosen.compilable:
        from .compiled.estimator import CompiledEstimator  # late: numba takes long to import, and names need it not

        return CompiledEstimator(structure, test, chosen, method)
    return recipe.estimator(structure, test, chosen, method)


def _check_masses_alone(structure: Structure, effects: Mapping[str, Effect]) -> None:
    """Raises ModelError where an effect changes the balance of momentum from which effective masses are found."""
    for spec in structure.effects:
        if spec.type in effects and effects[spec.type].balances_momentum:
            raise ModelError(
                f"model {structure.name}: effective masses cannot be found with effect {spec.type} on {spec.target}: "
                "leave one of them out"
            )
