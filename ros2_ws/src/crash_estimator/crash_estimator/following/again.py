"""The same samples once more, with another model."""

from ..core.estimate import ParameterStatus
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
            value, std, status = (columns.of[field][-1, k] for field in ("value", "std", "status"))
            # one that the model gives is not estimated here: whoever found it knows its sigma
            sigma, given = ("", ", as given") if status == ParameterStatus.KNOWN else (f" +- {std:.2g}", "")
            text += f"; {f'{name} {value:.4g}{sigma} {description.parameter_units[k]}'.rstrip()}{given}"
    return follower, text
