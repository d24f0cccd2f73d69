"""The same samples once more, with another model."""

from ..core.methods import AnyEstimator
from .follower import Follower


def estimated_again(old: Follower, estimator: AnyEstimator) -> tuple[Follower, str]:
    """A follower that is where the old one is, as if it had been there from the first sample on; a line on what is new.

    Raises FilterFailure.
    """
    follower = Follower(estimator, old.kept, old.floor)
    columns = follower.go_to(old.position)
    text = f"{follower.position - follower.floor} samples estimated again"
    description, there = estimator.description, old.estimator.description.parameters
    for k, name in enumerate(description.parameters):
        if columns and name not in there:
            value, std = (columns.of[field][-1, k] for field in ("value", "std"))
            text += f"; {name} {value:.4g} +- {std:.2g} {description.parameter_units[k]}"
    return follower, text
