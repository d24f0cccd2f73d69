"""Blocks -> estimates again, and what the validation says of them (thesis 3.7). Neither ROS nor Rerun here."""

from collections.abc import Callable, Iterable
from functools import reduce
from typing import NamedTuple

import numpy as np

from ..core.compare_free_run import Comparison, compare
from ..core.estimate import Description, Estimate, ParameterStatus, as_sent, nothing_said
from ..core.free_run import FreeRun, free_run
from ..core.structure import ModelError, Structure
from ..core.validation import Validation, validate
from .blocks import Block, ForceBlock, ParameterBlock, ResidualBlock, estimator_of, join, revision_of, said_of

MOST = 20_000
"""Samples; of a longer recording nothing is judged here: a viewer must not work for minutes."""


class Judged(NamedTuple):
    """One estimator's whole pass."""

    validation: Validation
    simulated: FreeRun | None  # None: it cannot be simulated
    comparisons: list[Comparison]


class Jury:
    """Keeps what the estimators say in one pass, and judges it when it is complete."""

    def __init__(self, structure_of: Callable[[str, int, str], Structure | None]):
        """structure_of: the model of an estimator, of a revision, with its name; None where it is not known."""
        self.structure_of = structure_of
        self.judged: dict[str, Judged | None] = {}  # None: it cannot be judged
        self.said: dict[str, list[Block]] = {}
        self.samples: dict[str, int] = {}

    def hear(self, block: Block) -> None:
        if block.estimator in self.judged:
            return
        kept = self.said.setdefault(block.estimator, [])
        if isinstance(block, ResidualBlock):
            self.samples[block.estimator] = self.samples.get(block.estimator, 0) + len(block.time_ns)
        if self.samples.get(block.estimator, 0) <= MOST:
            kept.append(block)
        else:
            kept.clear()

    def verdicts(self, names: Iterable[str]) -> dict[str, Judged]:
        """Of these, whose pass is complete, and of those before; who cannot be judged is left out."""
        for name in names:
            self.judged[name] = None  # should it fail
            blocks = self.said.pop(name, [])
            model = blocks[0].model if blocks else ""
            structure = self.structure_of(estimator_of(name), revision_of(name), model) if blocks else None
            self.judged[name] = judge(structure, blocks) if structure else None
        return {name: judged for name, judged in self.judged.items() if judged}


def judge(structure: Structure, blocks: list[Block]) -> Judged | None:
    """All blocks of one estimator in one pass; None where they do not belong to the structure."""
    parameters = residuals = forces = None
    for block in join(blocks):
        match block:
            case ParameterBlock():
                parameters = block
            case ResidualBlock():
                residuals = block
            case ForceBlock():
                forces = block
    if parameters is None or residuals is None or forces is None:
        return None
    fits = tuple(element.name for element in structure.elements) == forces.element
    if not fits:
        return None
    description = describe(parameters, residuals, forces)
    estimates = estimates_of(parameters, residuals, forces)
    judged = validate(structure, description, estimates)
    if not all(f"{element}.damping" in description.parameters for element in description.elements):
        return Judged(judged, None, [])  # a method that finds masses, say, gives no forces
    try:
        simulated = free_run(structure, description, estimates)
    except (ModelError, np.linalg.LinAlgError, FloatingPointError):
        return Judged(judged, None, [])
    return Judged(judged, simulated, compare(structure, description, simulated))


def describe(parameters: ParameterBlock, residuals: ResidualBlock, forces: ForceBlock) -> Description:
    own = _own(parameters)
    return Description(
        model=parameters.model,
        method=parameters.method,
        parameters=parameters.name[:own],
        parameter_units=parameters.unit[:own],
        equations=residuals.name,
        equation_units=residuals.unit,
        elements=forces.element,
        between=tuple((one, other) for one, _, other in (ends.partition("-") for ends in forces.between)),
        bodies=forces.body,
        masses=tuple(forces.mass),
    )


def estimates_of(parameters: ParameterBlock, residuals: ResidualBlock, forces: ForceBlock) -> list[Estimate]:
    """Samples that all three tell of; of the covariances only the diagonals are known."""
    blocks: list[Block] = [parameters, residuals, forces]
    common = reduce(np.intersect1d, (block.time_ns for block in blocks))
    places = zip(*(np.searchsorted(block.time_ns, common) for block in blocks), strict=True)
    nothing = nothing_said(describe(parameters, residuals, forces))
    fields = [(getattr(block, field), which, field) for which, block in enumerate(blocks) for field in said_of(block)]
    return [
        as_sent(
            nothing, parameters.number + int(rows[0]), time_ns,
            {field: table[rows[which]] for table, which, field in fields}, elsewhere=0.0,
        )
        for time_ns, rows in zip(common.tolist(), places, strict=True)
    ]  # fmt: skip


def _own(parameters: ParameterBlock) -> int:
    """How many are parameters of the model; what the method knows besides comes after them."""
    return int(np.count_nonzero(parameters.status[0] != ParameterStatus.METHOD))
