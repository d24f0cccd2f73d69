"""The orders of the noise model by an information criterion: a bank of Gauss-Newton estimators, one for each (p, q).

    criterion = sum over equations of n ln(mean eps^2) + c (p + q)

over the n prediction errors eps so far; c is ln n (BIC, Schwarz) or 2 (AIC, Akaike). What the bank says is what
its member with the smallest criterion says; the criterion of each equation alone gives orders for each equation.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..estimate import Event
from ..regression import Regression
from ..structure import ModelError
from .gauss_newton import THESIS, GaussNewton, GaussNewtonState
from .update import Theta, Update

SETTLING = 20
"""Samples at first whose errors are those of the initial values, not of the noise model."""


class OrderBankState(NamedTuple):
    members: tuple[GaussNewtonState, ...]
    seen: np.ndarray  # (q,) prediction errors counted or not
    squares: np.ndarray  # (members, q) sum of the counted ones' squares
    chosen: int


@dataclass(frozen=True)
class OrderBank:
    """Settings of the bank: all (p, q) up to `largest`, the same for all equations in each member."""

    settings: Theta
    largest: int = 2
    aic: bool = False  # Akaike's criterion instead of Schwarz's
    forgetting: float | None = None  # as in RLS
    memory: float = 0.005  # s, as in RLS
    printed: bool = False  # the members follow the thesis's 4.10 as printed; it has no such bank
    members: tuple[GaussNewton, ...] = field(init=False)

    def __post_init__(self):
        if not isinstance(self.largest, int) or not 0 <= self.largest <= 10:
            raise ModelError(f"largest order of gauss_newton_orders must be from 0 to 10, got {self.largest!r}")
        more: dict = THESIS if self.printed else {}
        members = tuple(GaussNewton(self.settings, p, q, self.forgetting, self.memory, **more) for p, q in self.tried)
        object.__setattr__(self, "members", members)

    @property
    def tried(self) -> list[tuple[int, int]]:
        """(p, q) of each member."""
        return [(p, q) for p in range(self.largest + 1) for q in range(self.largest + 1)]

    @property
    def regressor_errors(self) -> bool:
        """As its members have it."""
        return self.members[0].regressor_errors

    def extra_names(self, equations: tuple[str, ...]) -> dict[str, str]:
        """Name -> unit of `Update.extra`: the orders chosen."""
        return {"noise_model.p": "1", "noise_model.q": "1"}

    def init(self, equations: int) -> OrderBankState:
        states = tuple(member.init(equations) for member in self.members)
        return OrderBankState(states, np.zeros(equations), np.zeros((len(states), equations)), 0)

    def update(self, state: OrderBankState, regression: Regression) -> tuple[OrderBankState, Update]:
        seen = state.seen + ~np.isnan(regression.measured)
        count = (seen > SETTLING) & ~np.isnan(regression.measured)
        states, updates, squares = [], [], state.squares.copy()
        for k, (member, before) in enumerate(zip(self.members, state.members)):
            theta = before.rls.theta[: len(self.settings.initial)]
            after, update = member.update(before, regression)
            error = regression.measured - regression.known - regression.gradient @ theta - update.expected_error[0]
            squares[k, count] += error[count] ** 2
            states.append(after)
            updates.append(update)
        state = OrderBankState(tuple(states), seen, squares, state.chosen)
        chosen = int(np.argmin(self.criteria(state).sum(axis=1)))
        p, q = self.tried[chosen]
        events = updates[chosen].events
        if chosen != state.chosen:
            events += (Event("orders", "noise model", float(10 * p + q), f"noise model: p {p}, q {q}"),)
        return state._replace(chosen=chosen), updates[chosen]._replace(
            extra=(float(p), float(q)), extra_std=(), events=events
        )

    def criteria(self, state: OrderBankState) -> np.ndarray:
        """(members, q) the criterion of each member for each equation; smaller is better."""
        n = np.maximum(state.seen - SETTLING, 1.0)
        penalty = np.full_like(n, 2.0) if self.aic else np.log(n)
        order = np.sum(self.tried, axis=1)
        return n * np.log(np.maximum(state.squares / n, 1e-300)) + np.outer(order, penalty)

    def orders(self, state: OrderBankState) -> list[tuple[int, int]]:
        """The best (p, q) of each equation on its own."""
        return [self.tried[k] for k in np.argmin(self.criteria(state), axis=0)]
