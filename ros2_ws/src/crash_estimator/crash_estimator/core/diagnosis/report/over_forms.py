"""A coefficient over the forms in which its law may be written, where the recordings do not tell which."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..output_error.gauss_newton import Fit, fit
from ..output_error.problem import OutputErrorProblem
from ..parameterization.terms import Term
from ..selection.thresholds import THRESHOLDS


def std_over_forms(term: Term, found: Fit) -> list[float]:
    """Standard deviations s of an effect's coefficient and of the logarithms of its shape constants about those found;
    of a force that remembers, over all its forms k:

        s^2 = sum_k w_k (s_k^2 + (c_k - c)^2),      w_k the evidence of each, as a share of all

    a mixture's (Hoeting and others 1999, after their equation 3), about c: a gas that keeps its heat, and one that
    gives it away, follow the same motion with coefficients that differ by a third.
    """
    others = _in_other_forms(term, found) if term.addition.effect.remembers else ()
    fits = [found, *(one for one in others if np.isfinite(one.evidence))]  # of a motion that diverges nothing is known
    evidence = np.array([one.evidence for one in fits])
    weight = np.exp(evidence - evidence.max())
    of = [term.coefficient, *term.shapes.values()]
    squares = [np.diagonal(one.covariance)[of] + (one.theta[of] - found.theta[of]) ** 2 for one in fits]
    return np.sqrt(np.average(squares, axis=0, weights=weight)).tolist()


def _in_other_forms(term: Term, found: Fit) -> Iterator[Fit]:
    effect, problem = term.addition.effect, found.problem
    hopeless = found.cost + 2.0 * THRESHOLDS.confounded
    for form in (one for one in effect.variants if one != term.addition.variant):
        yield fit(_written(problem, term, form), found.point, hopeless=hopeless)


def _written(problem: OutputErrorProblem, term: Term, form: str) -> OutputErrorProblem:
    """The same parameters, with the law of a term in another form."""
    other = term._replace(addition=replace(term.addition, variant=form))

    def with_other(terms: tuple[Term, ...]) -> tuple[Term, ...]:
        return tuple(other if one is term else one for one in terms)

    layout = problem.layout
    links = tuple(replace(link, terms=with_other(link.terms)) for link in layout.links)
    return problem._replace(layout=layout._replace(links=links, terms=with_other(layout.terms))).on(problem.records)
