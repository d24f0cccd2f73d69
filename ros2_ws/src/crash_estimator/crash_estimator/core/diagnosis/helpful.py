"""Of the rounds of a search that has explained nothing in the end, those that are worth telling."""

from collections.abc import Sequence

from .answer import fit_stated, place_of
from .model import Model
from .rounds import Round


def helpful(rounds: Sequence[Round], final: Model, present: int) -> tuple[list[Round], Model]:
    """The rounds, and the last model, up to the one that leaves the least, and while each addition is more than nothing.

    What leaves white noise stands as it is. In a noise as large as the misfit a fit can end where the evidence is
    better and the error is not: what comes after the least error is no part of an explanation.
    """
    models = [round_.before for round_ in rounds]
    if models[-1] is not final:
        models.append(final)
    if final.left.whiteness.white:
        return list(rounds), final
    errors = [model.left.rms for model in models[: 1 + len(final.additions) - present]]
    told = errors.index(min(errors))
    told = next((k for k, round_ in enumerate(rounds[:told]) if _is_nothing(round_, final)), told)
    return (list(rounds[: told + 1]), models[told]) if told < len(errors) - 1 else (list(rounds), final)


def _is_nothing(round_: Round, final: Model) -> bool:
    """An addition whose coefficient has ended at zero; beside a body's curve, its mass may."""
    fitted, addition = fit_stated(round_, final), round_.tried[0].addition
    return not addition.touches and fitted.theta[place_of(fitted.layout, addition).coefficient] == 0.0
