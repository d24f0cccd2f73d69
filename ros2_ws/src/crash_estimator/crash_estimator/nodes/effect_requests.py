"""Requests to add an effect: how an effect's constants travel as text."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from crash_msgs.msg import ModelEffect
from crash_msgs.srv import AddEffect

from crash_replay.recording import Test

from ..core.effects import EFFECTS
from ..core.effects.change import add_effect
from ..core.effects.effect import Effect
from ..core.structure import EffectSpec, ModelError, Structure

WORDS = {"host": "host", "touches": "touches", "taken_from": "taken_from", "form": "variant"}
"""Options that are names, as a model file writes them, and what an EffectSpec calls them; any other is a number."""


def request_of(spec: EffectSpec) -> AddEffect.Request:
    """The request that adds just this effect; numbers keep all their digits."""
    numbers = {"coefficient": spec.coefficient} if spec.coefficient is not None else {}
    options = [f"{name}={float(value)!r}" for name, value in (numbers | dict(spec.shape)).items()]
    options += [f"{name}={value}" for name, ours in WORDS.items() if (value := getattr(spec, ours))]
    return AddEffect.Request(effect=spec.type, target=spec.target, options=options)


def model_effect(spec: EffectSpec) -> ModelEffect:
    """The same, as an estimator tells of it."""
    request = request_of(spec)
    return ModelEffect(effect=request.effect, target=request.target, options=request.options)


def with_effects(structure: Structure, said: Sequence[ModelEffect], test: Test | None = None) -> Structure:
    """The structure with just the effects that an estimator has told of; raises ModelError with one line."""
    structure = replace(structure, effects=())
    for one in said:
        request = AddEffect.Request(effect=one.effect, target=one.target, options=list(one.options))
        structure = with_effect(structure, request, test=test)
    return structure


def with_effect(
    structure: Structure,
    request: AddEffect.Request,
    effects: Mapping[str, Effect] = EFFECTS,
    test: Test | None = None,
) -> Structure:
    """The structure with the effect that a request asks for; raises ModelError with one line."""
    words, numbers = _options(request)
    coefficient = numbers.pop("coefficient", None)
    return add_effect(structure, request.effect, request.target, effects, test, coefficient, numbers, **words)


def _options(request: AddEffect.Request) -> tuple[dict[str, str], dict[str, float]]:
    words: dict[str, str] = {}
    numbers: dict[str, float] = {}
    for option in request.options:
        name, _, text = option.partition("=")
        if name in (*WORDS, "variant"):  # as it was said before it was called a form
            words[WORDS.get(name, name)] = text
            continue
        try:
            numbers[name] = float(text)
        except ValueError:
            raise ModelError(
                f"effect {request.effect} on {request.target}: an option is written coefficient=1810, host=car or "
                f"SHAPE_CONSTANT=NUMBER, got {option!r}"
            ) from None
    return words, numbers
