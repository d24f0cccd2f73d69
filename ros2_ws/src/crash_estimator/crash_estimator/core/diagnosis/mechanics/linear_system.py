"""The linearised equations of motion, as the compiled passes of `propagate` take them."""

from typing import NamedTuple

import numpy as np
from numba import njit

from ... import compile_cache as _compile_cache  # noqa: F401  before any compiled function is defined


class Linear(NamedTuple):
    """The linearised equations on g instants, for b bodies, l links, and columns before those of the curve knots."""

    dt: np.ndarray  # (g,) s to the instant from the one before; 0 at the first
    ends: np.ndarray  # (l, 2) bodies that the link's force acts on
    crush_ends: np.ndarray  # (l, 2) bodies whose distance is its crush; -1: measured, it does not move
    inverse_mass: np.ndarray  # (b,) 1/kg of a free body, 1 of a fixed one whose force is measured (its row), else 0
    kind: np.ndarray  # (b,) FREE, DRIVEN or FIXED
    kx: np.ndarray  # (l, g) dF/dX
    kv: np.ndarray  # (l, g) dF/dV
    kp: np.ndarray  # (l, g) dF/dX_peak; 0 while the crush is at its peak
    loading: np.ndarray  # (l, g) the crush is at a peak that is felt later
    knot: np.ndarray  # (l, g, 2) of the two curve knots in use: their columns, after `others`; -1: none
    weight: np.ndarray  # (l, g, 2) dF/d(force at that knot)
    changed: np.ndarray  # (g,) bool, a slope or the step is another than at the instant before
    start: np.ndarray  # (2, b, others) m/s and m at time zero
    observer: float  # 1/s, rate at which free bodies are drawn to the measured motion: -o^2 xi - 2 o xi'
    others: int  # columns before those of the knots
    column: np.ndarray  # (m,) of them, in which something acts ...
    body: np.ndarray  # (m,) ... on this body:
    acts: np.ndarray  # (m, g) an external acceleration (free, driven) or force (fixed)
    remembers: np.ndarray  # (m,) the link of each memory, kept z + by_crush X - by_before (the X before)
    kept: np.ndarray  # (m, g)
    by_crush: np.ndarray  # (m, g) 1/m
    by_before: np.ndarray  # (m, g) 1/m
    recalled: np.ndarray  # (m, g) N, dF/dz; dF/dX by z itself is in kx
    touched: np.ndarray  # (g,) columns of knots, in the order of their first use, that are in use so far: see `ranked`


class Sampling(NamedTuple):
    """How body rows become outputs: q outputs, averaged over bins of samples."""

    body: np.ndarray  # (q,)
    of_motion: np.ndarray  # (q,) 0: the row itself, 1: its integral, 2: the integral of that
    gain: np.ndarray  # (q,)
    lag: np.ndarray  # (q,) whole steps of the grid
    fraction: np.ndarray  # (q,) and the rest of a step
    bin: np.ndarray  # (g,) bin of the sample at this instant; -1: no sample here
    weight: np.ndarray  # (g, q) 0 where a sample is not valid, else 1 / (sigma sqrt(samples in the bin))


@njit(cache=True)
def ranked(knot, knots):
    """Knots (l, g, 2) numbered in the order of their first use, what stands at each number (n,), and how many have
    been in use (g,): before it is first used, nothing of a knot is felt."""
    rank, order, touched = np.full(knots, -1), np.empty(knots, np.int64), np.empty(knot.shape[1], np.int64)
    found, count = np.full(knot.shape, -1), 0
    for t in range(knot.shape[1]):
        for link in range(knot.shape[0]):
            for side in range(2):
                number = knot[link, t, side]
                if number < 0:
                    continue
                if rank[number] < 0:
                    rank[number], order[count] = count, number
                    count += 1
                found[link, t, side] = rank[number]
        touched[t] = count
    return found, order[:count], touched
