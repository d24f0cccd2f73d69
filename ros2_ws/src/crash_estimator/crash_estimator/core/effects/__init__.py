"""The vocabulary of physical effects: one file each, in this table."""

from . import (
    added_mass,
    bottoming_out,
    channel_delay,
    channel_gain,
    channel_offset,
    clearance,
    constant_force,
    coulomb_friction,
    cubic_stiffness,
    force_offset,
    gas_cushion,
    guide_friction,
    hysteresis,
    initial_velocity,
    load_path,
    maxwell_element,
    plastic_unloading,
    quadratic_damping,
    rate_hardening,
    unmodelled_body,
    viscous_damping,
    yielding,
)
from .effect import Effect

_FILES = (
    viscous_damping,
    quadratic_damping,
    coulomb_friction,
    hysteresis,
    maxwell_element,
    gas_cushion,
    rate_hardening,
    cubic_stiffness,
    clearance,
    bottoming_out,
    yielding,
    plastic_unloading,
    load_path,
    added_mass,
    unmodelled_body,
    constant_force,
    guide_friction,
    initial_velocity,
    channel_delay,
    channel_gain,
    channel_offset,
    force_offset,
)

EFFECTS: dict[str, Effect] = {file.EFFECT.name: file.EFFECT for file in _FILES}
