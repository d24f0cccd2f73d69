"""Of the rounds of a search that has explained nothing in the end, those that are worth telling."""

from collections.abc import Sequence

from .answer import fit_stated, place_of
from .model import Model
from .rounds import Round


def helpful(rounds: Sequence[Round], final: Model, present: int) -> tuple[list[Round], Model]:
    """The rounds, and the last model, as far as each addition has lowered the error and is more than nothing.

    What leaves white noise stands as it is. In a noise as large as the misfit a fit can end where the evidence is
    better and the error is not: that is no part of an explanation, and neither is what was found after it.
    """
    models = [round_.before for round_ in rounds]
    if models[-1] is not final:
        models.append(final)
    added = len(final.additions) - present
    if final.left.whiteness.white:
        return list(rounds), final
    for k, (round_, before, after) in enumerate(zip(rounds[:added], models, models[1:])):
        fitted = fit_stated(round_, final)
        nothing = fitted.theta[place_of(fitted.layout, round_.tried[0].addition).coefficient] == 0.0
        if nothing or not after.left.rms < before.left.rms:
            return list(rounds[: k + 1]), before
    return list(rounds), final
