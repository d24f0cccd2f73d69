"""A structure, a test's channels and a method's settings as arrays that compiled code can read."""

from typing import NamedTuple

import numpy as np

from ..contact import Contact
from ..estimators.kalman import Kalman
from ..estimators.rls import NOISE_FLOOR, Rls
from ..estimators.update import Theta
from ..kinematics import Kinematics
from ..regression import Regressor
from .layout import Size


class Plan(NamedTuple):
    """Who is measured by what, and who pushes whom. c channels, b bodies, e elements, q equations;
    all parameters for those of the model, p for those that are estimated."""

    first_channel: np.ndarray  # (b + 1,) accelerometers of body k: body_channels[first_channel[k] : first_channel[k + 1]]
    body_channels: np.ndarray
    has_offset: np.ndarray  # (c,) bool
    initial_displacement: np.ndarray  # (b,)
    initial_velocity: np.ndarray  # (b,)
    ends: np.ndarray  # (e, 2)
    crush_channel: np.ndarray  # (e,) -1: integrated
    rate_channel: np.ndarray  # (e,) -1: integrated, or derived from a measured crush
    equation_body: np.ndarray  # (q,) -1: a measured force
    force_channel: np.ndarray  # (q,) -1: a balance
    share: np.ndarray  # (q, e)
    compression_only: np.ndarray  # (e,) bool
    unloading: np.ndarray  # (e,) 0: elastic
    element: np.ndarray  # (all,)
    is_stiffness: np.ndarray  # (all,) bool
    slot: np.ndarray  # (all,) place among the estimated ones, -1: known
    value: np.ndarray  # (all,) known or initial
    stiffness: np.ndarray  # (e,) which of all is the element's stiffness
    given_noise: np.ndarray  # (q,) variance; NaN: from before the impact
    drift_squared: np.ndarray  # (p,)
    initial: np.ndarray  # (p,)
    std: np.ndarray  # (p,)
    lower: np.ndarray  # (p,)
    upper: np.ndarray  # (p,)
    scale: np.ndarray  # (p,)
    own_offset: np.ndarray  # (q, b) 1 where the equation is that body's balance
    crush_of_body: np.ndarray  # (e, b) d(crush) / d(displacement)
    damping: np.ndarray  # (e,) which of all is the element's damping


class MethodPlan(NamedTuple):
    """Settings of the Kalman filter, or of RLS and MRLS; what the other one needs is left at NaN or 0."""

    is_kalman: bool
    constrained: bool = True
    noise_memory: float = np.nan
    forgetting: float = np.nan  # NaN: from the memory
    memory: float = np.nan
    cr: float = np.nan
    step_limit: float = np.nan
    error_limit: float = np.nan
    rewinds: int = 0
    noise_floor: float = np.nan


def make_plan(kinematics: Kinematics, contact: Contact, regressor: Regressor, settings: Theta) -> Plan:
    """The arrays of the numpy form's settings, so that both forms start from the same numbers."""
    structure = kinematics.structure
    e, q = len(structure.elements), len(structure.equations)
    estimated = regressor.estimated
    per_body = [columns for _, columns in kinematics.accelerometers]
    return Plan(
        first_channel=np.cumsum([0, *[len(columns) for columns in per_body]]),
        body_channels=np.array([column for columns in per_body for column in columns], dtype=np.int64),
        has_offset=kinematics.offsets,
        initial_displacement=kinematics.initial_displacement,
        initial_velocity=kinematics.initial_velocity,
        ends=structure.ends,
        crush_channel=_placed(kinematics.crush_channels, e),
        rate_channel=_placed(kinematics.rate_channels, e),
        equation_body=_placed(kinematics.balances, q),
        force_channel=_placed(kinematics.force_channels, q),
        share=regressor.share,
        compression_only=contact.compression_only,
        unloading=contact.unloading,
        element=regressor.element,
        is_stiffness=regressor.is_stiffness,
        slot=np.where(estimated, np.cumsum(estimated) - 1, -1),
        value=settings.initial,
        stiffness=regressor.stiffness_index,
        given_noise=regressor.noise,
        drift_squared=regressor.drift_squared[estimated],
        initial=settings.initial[estimated],
        std=settings.std[estimated],
        lower=settings.lower[estimated],
        upper=settings.upper[estimated],
        scale=settings.scale[estimated],
        own_offset=regressor.own_offset,
        crush_of_body=regressor.crush_of_body,
        damping=regressor.damping_index,
    )


def make_method_plan(method: Kalman | Rls) -> MethodPlan:
    if isinstance(method, Kalman):
        return MethodPlan(True, constrained=bool(method.constrained), noise_memory=float(method.noise_memory))
    return MethodPlan(
        False,
        forgetting=np.nan if method.forgetting is None else float(method.forgetting),
        memory=float(method.memory),
        cr=float(method.cr),
        step_limit=float(method.step_limit),
        error_limit=float(method.error_limit),
        rewinds=int(method.rewinds),
        noise_floor=NOISE_FLOOR,
    )


def make_size(plan: Plan, method: Kalman | Rls) -> Size:
    window = 0 if isinstance(method, Kalman) else int(method.m)
    return Size(
        len(plan.has_offset),
        len(plan.initial_velocity),
        len(plan.ends),
        len(plan.element),
        len(plan.initial),
        len(plan.initial_velocity) if isinstance(method, Kalman) and method.offsets else 0,
        len(plan.share),
        window,
    )


def _placed(pairs: list[tuple[int, int]], length: int) -> np.ndarray:
    """[(place, value), ...] -> an array with -1 wherever nothing is placed."""
    placed = np.full(length, -1, dtype=np.int64)
    for place, value in pairs:
        placed[place] = value
    return placed
