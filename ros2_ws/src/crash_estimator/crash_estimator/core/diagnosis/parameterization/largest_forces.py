"""The largest forces on bodies and in elements, as far as inertia and measured forces tell them."""

from collections.abc import Iterable, Sequence

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, maximum_flow

from ...structure import Structure
from ..observation.grid import binned
from ..observation.record import ObservedRecord, outputs_of
from ..observation.trajectory import Trajectory


def largest_on_bodies(
    structure: Structure, records: Sequence[ObservedRecord], measured: Sequence[Trajectory]
) -> np.ndarray:
    """(b,) N, of all that acts on each body, or that is applied to it if that is more; inf for a driven one."""
    outputs = outputs_of(structure)
    found = np.full(len(structure.bodies), np.inf)
    for k, body in enumerate(structure.bodies):
        rows = [q for q, output in enumerate(outputs) if output.body == k]
        if body.motion_channel or body.derived:
            found[k] = body.mass * max(float(np.abs(motion.a[:, k]).max()) for motion in measured)
        elif rows:
            inertia = body.mass if body.free else 1.0
            found[k] = inertia * max(_peak(record, record.measured[:, rows]) for record in records)
        if body.applied:
            pushed = max(float(np.abs(record.signals[body.applied].values).max()) for record in records)
            found[k] = max(found[k], pushed) if rows else pushed
    return found


def largest_in_elements(
    structure: Structure, records: Sequence[ObservedRecord], measured: Sequence[Trajectory], on_bodies: np.ndarray
) -> np.ndarray:
    """(e,) N, by what all bodies on one side of each element are accelerated by, where the structure is cut through it
    and through as few others as need be. The less of both sides, and of the ends where those do not tell it.

    on_bodies (b,): `largest_on_bodies`. A light body between two elements feels but their difference: of a drop test
    the specimen's force was ten times its platen's.
    """
    found = np.full(len(structure.elements), np.inf)
    for k, ends in enumerate(structure.ends):
        for end, side in zip(ends, _sides(structure, k), strict=True):
            if len(side) == 1:
                found[k] = min(found[k], on_bodies[end])
            elif side and side <= set(structure.equations):
                pairs = zip(records, measured, strict=True)
                found[k] = min(
                    found[k], max(_peak(one, _on_all(structure, one, motion, side)) for one, motion in pairs)
                )
        if np.isinf(found[k]):
            found[k] = min(on_bodies[ends])
    return np.where(np.isfinite(found), found, on_bodies[np.isfinite(on_bodies)].max())


def _sides(structure: Structure, element: int) -> list[set[int]]:
    """The bodies beside each end of an element, up to the nearest cut of fewest elements between its ends (maximum flow
    and least cut, Ford and Fulkerson 1956); elements between the same bodies are one, and a carried body its carrier.
    """
    carrier = np.array([structure.body_index.get(body.carried_by, k) for k, body in enumerate(structure.bodies)])
    joined = np.zeros((len(carrier), len(carrier)), np.int32)
    joined[tuple(carrier[structure.ends].T)] = 1
    joined |= joined.T
    a, b = carrier[structure.ends[element]]
    if a == b:
        return [set(), set()]
    left = csr_array(joined - maximum_flow(csr_array(joined), a, b).flow.toarray())
    ways = (left, a), (left.T.tocsr(), b)
    return [set(breadth_first_order(*way, return_predecessors=False).tolist()) for way in ways]


def _on_all(structure: Structure, record: ObservedRecord, motion: Trajectory, bodies: Iterable[int]) -> np.ndarray:
    """(n, 1) N at the samples, of the elements on these bodies together, each of which has an equation."""
    found = np.zeros((len(record.at), 1))
    for k in bodies:
        body = structure.bodies[k]
        if body.free:
            found[:, 0] += body.mass * motion.a[record.at, k]
            found[:, 0] -= record.signals[body.applied].on_grid[record.at] if body.applied else 0.0
        else:
            found[:, 0] += record.signals[body.force].on_grid[record.at]
    return found


def _peak(record: ObservedRecord, sampled: np.ndarray) -> float:
    """Largest mean over a bin of what is sampled (n, columns)."""
    known = np.isfinite(sampled)
    each = np.stack([np.where(known, sampled, 0.0).sum(axis=1), known.sum(axis=1)], axis=1)
    total, count = binned(record.bin[record.at], each, record.bins).T
    return float(np.abs(total / np.maximum(count, 1.0)).max())
