"""Answers of a diagnosis -> crash_msgs: the one file of the diagnosis node that knows both worlds."""

from array import array
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from builtin_interfaces.msg import Time
from crash_msgs.msg import Misfit, MisfitWindow, RankedEffect, Ranking, Revision
from std_msgs.msg import Header

from ..core.structure import EffectSpec, Structure

if TYPE_CHECKING:  # an answer brings it along
    from ..core.diagnosis import FitCurves, OnlineAnswer, Ranked


class Moment(NamedTuple):
    """What an answer is about."""

    run: int
    number: int  # of the last sample used
    time_ns: int  # of that sample, since the impact
    stamp: Time  # likewise
    structure: Structure
    revision: int
    final: bool


def ranking_message(at: Moment, answer: "OnlineAnswer") -> Ranking:
    before, after = answer.white
    return Ranking(
        header=Header(stamp=at.stamp, frame_id=at.structure.name),
        run=at.run,
        number=at.number,
        time=at.time_ns * 1e-9,
        final=answer.final,
        model=at.structure.name,
        verdict=answer.verdict,
        complete=answer.complete,
        ranking=[_ranked(ranked) for ranked in answer.ranking],
        rms_before=answer.rms.before,
        rms_after=answer.rms.after,
        noise_floor=answer.noise_floor,
        text=answer.text,
        revision=at.revision,
        effects=names(at.structure.effects),
        found=names(answer.found),
        white_before=before.white,
        white_after=after.white,
        whiteness_before=before.probability,
        whiteness_after=after.probability,
        free_run_before=answer.free_run.before,
        free_run_after=answer.free_run.after,
        force=answer.force,
        force_explained_before=answer.force_explained.before,
        force_explained_after=answer.force_explained.after,
    )


def misfit_message(at: Moment, answer: "OnlineAnswer") -> Misfit:
    windows = [MisfitWindow(start=w.start, end=w.end, body=w.body, state=w.state, rms=w.rms) for w in answer.misfit]
    model = at.structure.name
    header = Header(stamp=at.stamp, frame_id=model)
    return Misfit(header=header, run=at.run, number=at.number, model=model, windows=windows)


def revision_message(at: Moment, model: str, number: int, stamp: Time, fit: "FitCurves", rows: slice) -> Revision:
    """The rows of a revision's curves; model: its name; number and stamp: of their first sample."""
    measured, predicted = fit.measured[rows], fit.predicted[rows]
    tables = {
        "measured": measured,
        "predicted": predicted,
        "residual": measured - predicted,
        "noise_std": np.broadcast_to(fit.noise, measured.shape),
    }
    return Revision(
        header=Header(stamp=stamp, frame_id=model),
        run=at.run,
        number=number,
        time_ns=array("q", fit.time_ns[rows].tobytes()),
        model=model,
        revision=at.revision,
        effects=names(fit.effects),
        final=at.final,
        name=list(fit.names),
        unit=list(fit.units),
        **{name: array("d", table.tobytes()) for name, table in tables.items()},
    )


def names(effects: Sequence[EffectSpec]) -> list[str]:
    return [f"{spec.type} on {spec.target}" for spec in effects]


def revision_name(given: Structure, structure: Structure, found: Sequence[EffectSpec]) -> str:
    """Of the model as it was given, with what was taken out of it and added since: "model + effect on target"."""
    had, has = names(given.effects), names([*structure.effects, *found])
    gone = [f" - {name}" for name in had if name not in has]
    new = [f" + {name}" for name in has if name not in had]
    return given.name + "".join(gone + new)


def _ranked(ranked: "Ranked") -> RankedEffect:
    return RankedEffect(
        effect=ranked.effect,
        target=ranked.target,
        coefficient=float(ranked.coefficient),
        std=float(ranked.std),
        unit=ranked.unit,
        evidence=ranked.evidence,
        explained=ranked.explained,
        identifiable=ranked.identifiable,
        confounded_with=list(ranked.confounded_with),
    )
