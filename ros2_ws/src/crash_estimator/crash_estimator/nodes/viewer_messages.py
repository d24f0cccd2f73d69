"""crash_msgs -> the viewer's blocks: the one file of the viewer that knows both worlds."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from crash_msgs.msg import (
    Event,
    Forces,
    Misfit,
    ParametersBlock,
    RankedEffect,
    Ranking,
    ResidualsBlock,
    Revision,
    TestInfo,
)

from crash_replay.foreign_text import visible
from crash_replay.recording import RecordingError

from ..viewer.blocks import EventBlock, ForceBlock, ParameterBlock, ResidualBlock, TestBlock, said_of, speaker
from ..viewer.findings import Candidate, MisfitBlock, RankingBlock, RevisionBlock, Window


def test_block(message: TestInfo) -> TestBlock:
    name, title, source = map(visible, (message.id, message.title, message.source))
    return TestBlock(name, title, source, int(message.samples), float(message.sample_period))


def parameter_block(estimator: str, message: ParametersBlock) -> ParameterBlock:
    names = tuple(message.name)
    said = _tables(message, len(names), said_of(ParameterBlock))
    return ParameterBlock(**_head(estimator, message), name=names, unit=tuple(message.unit), **said)


def residual_block(estimator: str, message: ResidualsBlock) -> ResidualBlock:
    names = tuple(message.name)
    said = _tables(message, len(names), said_of(ResidualBlock))
    return ResidualBlock(**_head(estimator, message), name=names, unit=tuple(message.unit), **said)


def force_block(estimator: str, message: Forces) -> ForceBlock:
    elements, bodies = tuple(message.element), tuple(message.body)
    return ForceBlock(
        **_head(estimator, message),
        element=elements,
        between=tuple(message.between),
        body=bodies,
        mass=np.asarray(message.mass),
        **_tables(message, len(elements), said_of(ForceBlock, "elements")),
        **_tables(message, len(bodies), said_of(ForceBlock, "bodies")),
    )


def event_block(estimator: str, message: Event) -> EventBlock:
    return EventBlock(estimator, message.run, message.number, message.time, message.kind, message.target, message.text)


BLOCK_OF = {
    "block/parameters": (ParametersBlock, parameter_block),
    "block/residuals": (ResidualsBlock, residual_block),
    "forces": (Forces, force_block),
    "events": (Event, event_block),
}
"""An estimator's topic -> its message type and what makes a block of it."""


def ranking_block(message: Ranking) -> RankingBlock:
    return RankingBlock(
        message.run,
        message.number,
        message.time,
        message.final,
        message.model,
        message.verdict,
        tuple(_candidate(one) for one in message.ranking),
        message.rms_before,
        message.rms_after,
        message.noise_floor,
        message.text,
        message.revision,
        tuple(message.found),
        message.white_before,
        message.white_after,
        message.free_run_before,
        message.free_run_after,
        message.force,
        message.force_explained_before,
        message.force_explained_after,
        message.complete,
    )


def _candidate(one: RankedEffect) -> Candidate:
    numbers = (one.coefficient, one.std, one.unit, one.evidence, one.explained)
    return Candidate(one.effect, one.target, *numbers, one.identifiable, tuple(one.confounded_with))


def misfit_block(message: Misfit) -> MisfitBlock:
    windows = (Window(one.start, one.end, one.body, one.state, one.rms) for one in message.windows)
    return MisfitBlock(message.run, message.number, tuple(windows))


def revision_block(message: Revision) -> RevisionBlock:
    return RevisionBlock(
        message.run,
        message.number,
        np.asarray(message.time_ns, dtype=np.int64),
        message.model,
        message.final,
        tuple(message.name),
        tuple(message.unit),
        **_tables(message, len(message.name), ("measured", "predicted", "residual")),
        residual_std=_tables(message, len(message.name), ("noise_std",))["noise_std"],
    )


FINDING_OF = {
    "diagnosis/ranking": (Ranking, ranking_block),
    "diagnosis/misfit": (Misfit, misfit_block),
    "diagnosis/revisions": (Revision, revision_block),
}
"""A topic of the diagnosis -> its message type and what makes a finding of it."""


def _head(estimator: str, message: ParametersBlock | ResidualsBlock | Forces) -> dict[str, Any]:
    return {
        "estimator": speaker(estimator, message.revision),
        "run": message.run,
        "number": message.number,
        "time_ns": np.asarray(message.time_ns, dtype=np.int64),
        "model": message.model,
        "method": message.method,
    }


def _tables(
    message: ParametersBlock | ResidualsBlock | Forces | Revision, width: int, fields: Sequence[str]
) -> dict[str, Any]:
    """Fields of n x width values, sent row by row. Raises RecordingError where a length does not fit."""
    n = len(message.time_ns)
    for name in fields:
        if len(getattr(message, name)) != n * width:
            found = len(getattr(message, name))
            raise RecordingError(f"{name}: expected {n * width} values ({n} samples of {width}), found {found}")
    return {name: np.asarray(getattr(message, name)).reshape(n, width) for name in fields}
