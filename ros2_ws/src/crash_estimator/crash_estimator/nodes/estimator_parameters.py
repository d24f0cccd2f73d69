"""The parameters of `estimator`, and the settings of each method, with what they mean and may be."""

import math
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from crash_replay.node_parameters import NAME, Allowed, checked
from crash_replay.recording import RecordingError

from ..core.estimators.afmm import Afmm
from ..core.estimators.effective_mass import MassSettings
from ..core.estimators.gauss_newton import LONGEST, GaussNewton
from ..core.estimators.kalman import Kalman
from ..core.estimators.order_bank import OrderBank
from ..core.estimators.rls import Rls
from ..core.methods import METHODS, PRESETS
from ..core.structure import ModelError
from ..ready_models import MODEL

PARAMETERS = {
    "model": Allowed("", MODEL, needed=f"give {MODEL}"),
    "method": Allowed("constrained_kalman", "how it is estimated", choices=tuple(METHODS)),
    "effects": Allowed("", "your own effects, a .py file; it is executed"),
    "effective_mass": Allowed(False, "find the masses that go with the accelerometers first"),
    "value_topics": Allowed([""], "parameters that get a topic of their own, names or patterns such as *.stiffness"),
    "replay": Allowed("", "node that samples are asked of which were missed; empty: the replay there is", pattern=NAME),
}

LONG = 1e3
"""s, of a memory: longer than any crash; what is learnt is then kept for good."""
TIMES = 1e3
"""Highest factor: beyond it a limit limits nothing."""
COUNT = 1000
"""Highest number of samples or models: more of them take longer than the samples leave."""
LEAST = 1e-9
"""Lowest value of what must be above 0, and its distance from what it must be below."""

FORGETTING = Allowed(0.0, "information kept from one sample to the next; 0: exp(-dt / memory)", 0.0, 1.0)
MEMORY = Allowed(0.0, "s that information is kept where forgetting is 0", LEAST, LONG)
REGRESSOR_ERRORS = Allowed(
    False,
    "count errors of the integrated motion and the lag in the sigmas, and hold a coefficient until its crush is known",
)
OF_RLS = {
    "noise_floor": Allowed(0.0, "share of the known noise variance that is added to the error's", 0.0, 1.0),
    "forget_excited": Allowed(False, "a sample forgets only the parameters that it tells something about"),
    "constrained": Allowed(False, "keep the parameters' bounds"),
    "regressor_errors": REGRESSOR_ERRORS,
}
SETTINGS: dict[type, dict[str, Allowed]] = {
    Rls: {
        "forgetting": FORGETTING,
        "memory": MEMORY,
        "m": Allowed(0, "samples in the moving mean of the error that is watched; 0: none, plain RLS", 0, COUNT),
        "cr": Allowed(0.0, "by which the correction is multiplied where that mean leaves its limit", 0.0, TIMES),
        "step_limit": Allowed(0.0, "longest step, as a share of each parameter's scale", 0.0, TIMES),
        "error_limit": Allowed(0.0, "limit of that mean, times its standard deviation", 0.0, TIMES),
        "rewinds": Allowed(0, "times that the same samples are used again at most", 0, COUNT),
        **OF_RLS,
        "learn_limit": Allowed(False, "learn that standard deviation; else that of the noise before the impact"),
        "limit_every_step": Allowed(False, "step_limit holds for every step, not only for repeated ones"),
        "take_back": Allowed(False, "take back a repetition that leaves a larger mean error than it found"),
    },
    Kalman: {
        "constrained": Allowed(False, "keep the parameters' bounds"),
        "noise_memory": Allowed(0.0, "s over which the noise adapts; 0: that before the impact is kept", 0.0, LONG),
        "offsets": Allowed(False, "estimate the errors of the zero offsets as well"),
        "process_noise": Allowed(
            0.0, "constant process noise, scales of each parameter per root of 1 s; 0: it follows the crush", 0.0, TIMES
        ),
        "regressor_errors": REGRESSOR_ERRORS,
    },
    GaussNewton: {
        "p": Allowed(0, "autoregressive order of each equation's error", 0, LONGEST),
        "q": Allowed(0, "moving-average order of each equation's error", 0, LONGEST),
        "forgetting": FORGETTING,
        "memory": MEMORY,
        "noise_memory": Allowed(
            0.0, "s that the noise model's information is kept; 0: as long as the parameters'", 0.0, LONG
        ),
        "known_to": Allowed(
            0.0, "the noise model waits until the parameters add less than this share of the noise", LEAST, math.inf
        ),
        "largest_root": Allowed(0.0, "of the noise model, in modulus; inf: it may be unstable", LEAST, math.inf),
        **OF_RLS,
    },
    OrderBank: {
        "largest": Allowed(0, "orders p and q up to this one are tried side by side", 0, 10),
        "aic": Allowed(False, "choose by Akaike's criterion instead of Schwarz's"),
        "forgetting": FORGETTING,
        "memory": MEMORY,
        "printed": Allowed(False, "the members are the thesis's recursion as printed"),
    },
    Afmm: {
        "models": Allowed(0, "in the bank", 1, COUNT),
        "interval": Allowed(0.0, "s between updates, and between the jumps assumed; 0: every sample", 0.0, LONG),
        "probability": Allowed(0.0, "of a jump in one interval", LEAST, 1.0 - LEAST),
        "jump": Allowed(0.0, "standard deviation of a jump, times each parameter's scale", 0.0, TIMES),
        "threshold": Allowed(0.0, "probability from which a jump is reported", LEAST, 1.0 - LEAST),
        "noise_memory": Allowed(0.0, "s over which the noise is learnt; 0: that before the impact is kept", 0.0, LONG),
        "constrained": Allowed(False, "whether the models keep the parameters' bounds"),
        "regressor_errors": REGRESSOR_ERRORS,
    },
    MassSettings: {
        "interval": Allowed(0.0, "s of impulse and momentum; 0: every sample's forces", 0.0, LONG),
        "forgetting": Allowed(0.0, "information kept from one interval to the next", LEAST, 1.0),
        "weighted": Allowed(False, "an interval counts by the running variance of the error; else all alike"),
    },
}
"""Of each method's class; their defaults here say of what kind they are, the class has the values."""
DAMPING_AFTER = Allowed(
    0.0, "share of its value to which a stiffness must be known before its damping is estimated; 0: at once", 0.0, TIMES
)
PRESET = Allowed("ours", "what the other settings are by default: ours, or the thesis's recursion", choices=PRESETS)
PREFIX = "settings."


def settings_of(method: str, preset: str = "ours") -> dict[str, Allowed]:
    """Those that a method has, with the preset's defaults, as parameters of the node."""
    recipe = METHODS[method]
    table = dict(SETTINGS[recipe.kind])
    defaults = {field.name: field.default for field in fields(recipe.kind)} | recipe.defaults(preset)
    table = {name: one._replace(default=type(one.default)(defaults[name] or 0)) for name, one in table.items()}
    if recipe.kind is not MassSettings:
        table["damping_after"] = DAMPING_AFTER
    live = {f"{PREFIX}{name}": one._replace(live=True) for name, one in table.items()}
    return live | {f"{PREFIX}preset": PRESET._replace(default=preset)}


def table_for(given: dict[str, Any]) -> dict[str, Allowed]:
    """All parameters of a node that is started with these: its method says which settings there are.

    Raises ParameterError where there is no such method.
    """
    method = checked(PARAMETERS, "method", given.get("method", PARAMETERS["method"].default))
    preset = checked(settings_of(method), f"{PREFIX}preset", given.get(f"{PREFIX}preset", "ours"))
    return PARAMETERS | settings_of(
        method, preset if f"{PREFIX}preset" in given else _preset_of(given.get("model", ""))
    )


def _preset_of(model: Any) -> str:
    """The one that a model file states; "ours" also where there is no such file: that is said where it is needed."""
    from ..model_file import load_model  # late: `--help` need not wait for it

    try:
        return load_model(model).preset if model and isinstance(model, str) else "ours"
    except (ModelError, RecordingError):
        return "ours"


def settings_in(values: Mapping[str, Any]) -> dict[str, Any]:
    """The settings among a node's parameters, as `make_estimator` takes them: 0 is None where that is the default."""
    settings = {name.removeprefix(PREFIX): value for name, value in values.items() if name.startswith(PREFIX)}
    for name in ("forgetting", "damping_after"):
        if settings.get(name) == 0.0:
            settings[name] = None
    return settings
