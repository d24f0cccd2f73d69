"""A structure, a test's channels and a method's settings as arrays that compiled code can read."""

from typing import NamedTuple

import numpy as np

from ..contact import Contact
from ..estimators.kalman import Kalman
from ..estimators.rls import Rls
from ..estimators.update import Theta
from ..kinematics import Kinematics
from ..regression import Regressor
from .layout import Shapes, Size


class Plan(NamedTuple):
    """Who is measured by what, and who pushes whom. The whole numbers come first."""

    first_channel: np.ndarray  # of body k: body_channels[first_channel[k] : last_channel[k]]
    last_channel: np.ndarray
    body_channels: np.ndarray
    has_offset: np.ndarray  # 1: yes
    ends: np.ndarray
    crush_channel: np.ndarray  # -1: integrated
    rate_channel: np.ndarray  # -1: integrated, or derived from a measured crush
    equation_body: np.ndarray  # -1: a measured force
    force_channel: np.ndarray  # -1: a balance
    compression_only: np.ndarray  # 1: yes
    element: np.ndarray
    is_stiffness: np.ndarray  # 1: yes
    slot: np.ndarray  # place among the estimated ones, -1: known
    stiffness: np.ndarray  # which of all is the element's stiffness
    damping: np.ndarray  # which of all is the element's damping
    initial_displacement: np.ndarray
    initial_velocity: np.ndarray
    share: np.ndarray
    unloading: np.ndarray  # 0: elastic
    value: np.ndarray  # known or initial
    given_noise: np.ndarray  # variance; NaN: from before the impact
    drift_squared: np.ndarray
    initial: np.ndarray
    std: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    scale: np.ndarray
    own_offset: np.ndarray  # 1 where the equation is that body's
    crush_of_body: np.ndarray  # d(crush) / d(displacement) where it is integrated, else 0
    velocity_variance: np.ndarray  # of the initial velocity


WHOLE: Shapes = {
    **dict.fromkeys(("first_channel", "last_channel"), ("bodies",)),
    "body_channels": ("accelerometers",),
    "has_offset": ("channels",),
    "ends": ("elements", 2),
    **dict.fromkeys(("crush_channel", "rate_channel"), ("elements",)),
    **dict.fromkeys(("equation_body", "force_channel"), ("equations",)),
    "compression_only": ("elements",),
    **dict.fromkeys(("element", "is_stiffness", "slot"), ("parameters",)),
    **dict.fromkeys(("stiffness", "damping"), ("elements",)),
}
OTHERS: Shapes = {
    **dict.fromkeys(("initial_displacement", "initial_velocity"), ("bodies",)),
    "share": ("equations", "elements"),
    "unloading": ("elements",),
    "value": ("parameters",),
    "given_noise": ("equations",),
    **dict.fromkeys(("drift_squared", "initial", "std", "lower", "upper", "scale"), ("estimated",)),
    "own_offset": ("equations", "bodies"),
    "crush_of_body": ("elements", "bodies"),
    "velocity_variance": ("bodies",),
}
"""The shapes of a Plan's parts, in its order."""


class MethodPlan(NamedTuple):
    """Settings of the Kalman filter, or of RLS and MRLS; what the other one needs is left at NaN or 0.

    RLS and MRLS have a filter beside them (`estimators/lag.py`): the first two settings after the kind are of it."""

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
    listed = [column for _, columns in kinematics.accelerometers for column in columns]
    counts = np.array([len(columns) for _, columns in kinematics.accelerometers], dtype=np.int64)
    last_channel = np.cumsum(counts)
    return Plan(
        first_channel=last_channel - counts,
        last_channel=last_channel,
        body_channels=np.array(listed, dtype=np.int64),
        has_offset=kinematics.offsets,
        ends=structure.ends,
        crush_channel=_placed(kinematics.crush_channels, e),
        rate_channel=_placed(kinematics.rate_channels, e),
        equation_body=_placed(kinematics.balances, q),
        force_channel=_placed(kinematics.force_channels, q),
        compression_only=contact.compression_only,
        element=regressor.element,
        is_stiffness=regressor.is_stiffness,
        slot=np.where(estimated, np.cumsum(estimated) - 1, -1),
        stiffness=regressor.stiffness_index,
        damping=regressor.damping_index,
        initial_displacement=kinematics.initial_displacement,
        initial_velocity=kinematics.initial_velocity,
        share=regressor.share,
        unloading=contact.unloading,
        value=settings.initial,
        given_noise=regressor.noise,
        drift_squared=regressor.drift_squared[estimated],
        initial=settings.initial[estimated],
        std=settings.std[estimated],
        lower=settings.lower[estimated],
        upper=settings.upper[estimated],
        scale=settings.scale[estimated],
        own_offset=regressor.own_offset,
        crush_of_body=regressor.crush_of_body,
        velocity_variance=regressor.velocity_variance,
    )


def flat(size: Size, method: MethodPlan, plan: Plan) -> tuple[np.ndarray, np.ndarray]:
    """All of it as whole numbers and others: two arrays are handed on in a fifth of the time of so many.

    `views` has the way back.
    """
    whole, others = ([np.ravel(getattr(plan, part)) for part in parts] for parts in (WHOLE, OTHERS))
    return np.concatenate([size, *whole]).astype(np.int64), np.concatenate([method, *others]).astype(np.float64)


def make_method_plan(method: Kalman | Rls) -> MethodPlan:
    if isinstance(method, Kalman):
        return MethodPlan(True, constrained=bool(method.constrained), noise_memory=float(method.noise_memory))
    return MethodPlan(
        False,
        noise_memory=Kalman.noise_memory,
        forgetting=np.nan if method.forgetting is None else float(method.forgetting),
        memory=float(method.memory),
        cr=float(method.cr),
        step_limit=float(method.step_limit),
        error_limit=float(method.error_limit),
        rewinds=int(method.rewinds),
        noise_floor=float(method.noise_floor),
    )


def make_size(plan: Plan, method: Kalman | Rls) -> Size:
    bodies, estimated = len(plan.initial_velocity), len(plan.initial)
    offsets = bodies if isinstance(method, Kalman) and method.offsets else 0
    return Size(
        channels=len(plan.has_offset),
        accelerometers=len(plan.body_channels),
        bodies=bodies,
        elements=len(plan.ends),
        parameters=len(plan.element),
        estimated=estimated,
        offsets=offsets,
        unknowns=estimated + offsets,
        equations=len(plan.share),
        window=0 if isinstance(method, Kalman) else int(method.m),
    )


def _placed(pairs: list[tuple[int, int]], length: int) -> np.ndarray:
    """[(place, value), ...] -> an array with -1 wherever nothing is placed."""
    placed = np.full(length, -1, dtype=np.int64)
    for place, value in pairs:
        placed[place] = value
    return placed
