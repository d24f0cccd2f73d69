"""Models and candidates whose fits are made up, to judge what a search does with them."""

from types import SimpleNamespace

from crash_estimator.core.diagnosis.selection.candidate_fits import CandidateFit


def model(white=False, cost=1000.0, mean_square=50.0, evidence=0.0, additions=()):
    fit = SimpleNamespace(cost=cost, evidence=evidence, layout=None, point=None)
    residuals = SimpleNamespace(mean_square=mean_square)
    return SimpleNamespace(
        fit=fit, white=white, residuals=residuals, additions=additions, given=(), found=additions, records=(),
        roughness=None,
    )  # fmt: skip


def candidate(gain, key=("friction", "spring"), fitted=True):
    fit = SimpleNamespace(evidence=gain, layout=None, point=None)
    return CandidateFit(SimpleNamespace(key=key), gain, fit if fitted else None)
