"""The table of estimation methods."""

from collections.abc import Callable
from dataclasses import fields
from difflib import get_close_matches

from crash_replay.recording import Test

from .estimator import Estimator, Method
from .estimators.kalman import Kalman
from .estimators.rls import Rls
from .estimators.update import Theta, theta_settings
from .structure import ModelError, Structure


def _mrls(settings: Theta, m: int = 5, **others) -> Rls:
    return Rls(settings, m=m, **others)


METHODS: dict[str, Callable[..., Method]] = {
    "rls": Rls,
    "mrls": _mrls,
    "constrained_kalman": Kalman,
}


def make_estimator(structure: Structure, test: Test, method: str, **settings) -> Estimator:
    """An estimator of the structure's parameters on a test's channels.

    method: a key of METHODS; settings: fields of that method's dataclass, such as forgetting=0.98.
    Raises ModelError or RecordingError where the model does not fit the test, or a setting does not exist.
    """
    if method not in METHODS:
        near = get_close_matches(method, METHODS, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise ModelError(f"there is no method {method!r}, only {', '.join(METHODS)}{hint}")
    kind = Kalman if METHODS[method] is Kalman else Rls
    known = [f.name for f in fields(kind) if f.name != "settings"]
    for name in settings:
        if name not in known:
            near = get_close_matches(name, known, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            raise ModelError(f"method {method} has no setting {name!r}, only {', '.join(known)}{hint}")
    return Estimator(structure, test, METHODS[method](theta_settings(structure), **settings), method)
