"""Model files: YAML -> Structure. The keys are those of the README's table; nothing in a file is executed."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import AliasChoices, BaseModel, ConfigDict, Field, StrictBool, model_validator

from crash_replay.limits import MASS, NUMBER, Range
from crash_replay.yaml_schema import Text, number, read_yaml

from .core.effects.effect import Effect
from .core.effects.targets import check_effects
from .core.structure import Body, Coefficient, EffectSpec, Element, ModelError, Structure, Term
from .ready_models import model_path

MOST_PARTS = 100
"""Bodies, elements or effects: the work on a sample grows with the square of them and more."""

Number = number(NUMBER)
Positive = number(Range(1e-30, NUMBER.highest, "", "above 0, and so that its inverse is a number too"))
NotNegative = number(Range(0.0, NUMBER.highest, "", "0 has a meaning"))


class Part(BaseModel):
    """A mapping of the file: unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class CoefficientPart(Part):
    """`stiffness: 2.0e6` (known), or `stiffness: {estimate: true, initial: 5.0e5, min: 0.0}`."""

    estimate: StrictBool = False
    value: Number | None = None
    initial: Number | None = None
    std: Positive | None = None
    min: Number | None = None
    max: Number | None = None
    shape: Literal["curve", "constant"] = "curve"
    drift: NotNegative | None = None

    @model_validator(mode="before")
    @classmethod
    def _plain_number(cls, given: Any) -> Any:
        return {"value": given} if isinstance(given, (int, float)) and not isinstance(given, bool) else given

    @model_validator(mode="after")
    def _known_or_estimated(self):
        if self.estimate and self.value is not None:
            raise ValueError("give `initial` for an estimated coefficient, or `value` for a known one, not both")
        if not self.estimate and (self.value is None or self.initial is not None):
            raise ValueError("expected a number (known), or `estimate: true` with an `initial` value")
        low, high = self._bounds()
        start = self.initial if self.estimate and self.initial is not None else 0.0
        if low > high or (self.estimate and self.initial is not None and not low <= start <= high):
            raise ValueError(f"min <= initial <= max must hold, got min {low:g}, initial {start:g}, max {high:g}")
        return self

    def _bounds(self) -> tuple[float, float]:
        return -np.inf if self.min is None else self.min, np.inf if self.max is None else self.max

    def coefficient(self) -> Coefficient:
        low, high = self._bounds()
        value = self.initial if self.estimate else self.value
        return Coefficient(
            value=min(max(0.0, low), high) if value is None else value,
            estimated=self.estimate,
            std=self.std,
            min=low,
            max=high,
            drift=self.drift,
            shape=self.shape,
        )


class BodyPart(Part):
    mass: number(MASS) | None = None  # kg
    acceleration: Text | tuple[Text, ...] = ()
    motion: Text | tuple[Text, ...] | None = None
    fixed: StrictBool = False
    force: Text | None = None
    applied: Text | None = None
    displacement: Text | None = None
    velocity: Text | None = None
    noise: Positive | None = None  # m/s^2, or N for a measured force
    velocity_std: NotNegative = 0.0  # m/s, of the initial velocity

    @model_validator(mode="after")
    def _one_kind(self):
        if self.motion is not None and (self.fixed or self.acceleration or self.mass):
            raise ValueError("a driven body (`motion`) takes no mass, acceleration or fixed")
        if self.fixed and (self.acceleration or self.mass):
            raise ValueError("a fixed body takes no mass and no acceleration")
        of_free = [key for key in ("applied", "displacement", "velocity") if getattr(self, key)]
        if of_free and (self.fixed or self.motion is not None):
            raise ValueError(f"`{of_free[0]}` belongs to a free body, one with a mass")
        if self.force and not self.fixed:
            raise ValueError(
                "`force` is the measured force on a fixed body: add `fixed: true`, or call it `applied` where it "
                "pushes a free body"
            )
        return self

    def body(self, name: str) -> Body:
        channels = self.acceleration if self.motion is None else self.motion
        return Body(
            name,
            mass=self.mass,
            acceleration=(channels,) if isinstance(channels, str) else tuple(channels),
            driven=self.motion is not None,
            fixed=self.fixed,
            force=self.force,
            noise=self.noise,
            velocity_std=self.velocity_std,
            applied=self.applied,
            displacement=self.displacement,
            velocity=self.velocity,
        )


class ElementPart(Part):
    between: tuple[Text, Text]
    stiffness: CoefficientPart
    damping: CoefficientPart = CoefficientPart(value=0.0)
    tension: Literal["none", "both"] = "both"
    damper_pulls: StrictBool = True  # with `tension: none`: until the spring is spent
    acts_when_spent: Literal["nothing", "springs", "all"] = "nothing"  # beside a spring that is, on its line
    unloading: Positive | CoefficientPart | None = None  # N/m; or {estimate: true, initial: ...}
    crush_terms: dict[int, CoefficientPart] = {}  # power of the crush, 2 or more -> N/m^power
    rate_terms: dict[int, CoefficientPart] = {}  # power of the rate, 2 or more -> N (s/m)^power
    displacement: Text | None = None
    velocity: Text | None = None

    @model_validator(mode="after")
    def _checks(self):
        if self.between[0] == self.between[1]:
            raise ValueError(f"between must name two different bodies, got {self.between[0]} twice")
        if isinstance(self.unloading, CoefficientPart) and not (self.unloading.estimate and self.unloading.initial):
            raise ValueError("unloading takes a number (known), or `estimate: true` with an `initial` value above 0")
        for power in (*self.crush_terms, *self.rate_terms):
            if not 2 <= power <= 9:
                raise ValueError(
                    f"crush_terms and rate_terms have powers from 2 to 9 (the first is stiffness, damping), got {power}"
                )
        if not self.damper_pulls and self.tension == "both":
            raise ValueError("`damper_pulls: false` goes with `tension: none`")
        if self.velocity and not self.displacement:
            raise ValueError("`velocity` goes with `displacement`")
        return self

    def element(self, name: str) -> Element:
        return Element(
            name,
            between=self.between,
            stiffness=self.stiffness.coefficient(),
            damping=self.damping.coefficient(),
            tension=self.tension != "none",
            damper_pulls=self.damper_pulls,
            acts_when_spent=self.acts_when_spent,
            unloading=self.unloading if isinstance(self.unloading, float) else None,
            displacement=self.displacement,
            velocity=self.velocity,
            terms=tuple(
                Term(of, power, part.coefficient())
                for of, given in (("crush", self.crush_terms), ("rate", self.rate_terms))
                for power, part in sorted(given.items())
            ),
            unloading_slope=self.unloading.coefficient() if isinstance(self.unloading, CoefficientPart) else None,
        )


class EffectPart(Part):
    """`{type: coulomb_friction, element: door_rib}`; what the target is depends on the type."""

    type: Text
    element: Text | None = None
    body: Text | None = None
    channel: Text | None = None
    between: tuple[Text, Text] | None = None
    coefficient: Number | None = None
    shape: dict[Text, Positive] = {}
    host: Text | None = None
    touches: Text | None = None
    taken_from: Text | None = None
    form: Text = Field(
        "",
        validation_alias=AliasChoices("form", "variant"),  # as files written before have it
    )

    @model_validator(mode="after")
    def _one_target(self):
        given = [name for name in ("element", "body", "channel", "between") if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError("give one target: `element`, `body`, `channel` or `between: [a, b]`")
        return self

    def effect(self) -> EffectSpec:
        target = self.element or self.body or self.channel or "-".join(self.between)
        return EffectSpec(
            self.type, target, self.coefficient, self.shape, self.host, self.touches, self.taken_from, self.form
        )


class ModelFile(Part):
    name: Text = Field(min_length=1)
    bodies: dict[Text, BodyPart] = Field(min_length=1, max_length=MOST_PARTS)
    elements: dict[Text, ElementPart] = Field(min_length=1, max_length=MOST_PARTS)
    effects: list[EffectPart] = Field([], max_length=MOST_PARTS)
    preset: Literal["ours", "thesis"] = "ours"  # of the methods' settings

    def structure(self) -> Structure:
        return Structure(
            self.name,
            tuple(part.body(name) for name, part in self.bodies.items()),
            tuple(part.element(name) for name, part in self.elements.items()),
            tuple(part.effect() for part in self.effects),
            preset=self.preset,
        )


def load_model(name_or_path: str | Path, effects: Mapping[str, Effect] | None = None) -> Structure:
    """A ready model by its name, or a model file by its path.

    effects: those that it may name; None: they are left to whoever puts them to work.
    Raises ModelError or RecordingError with one line that names the file, the line and the key.
    """
    read = read_yaml(model_path(name_or_path), ModelFile)
    try:
        structure = read.content.structure()
        if effects is not None:
            check_effects(structure, effects)
    except ModelError as error:
        raise ModelError(f"{read.place(error.keys)}: {error}") from None
    return structure
