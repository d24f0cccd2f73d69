"""`diagnose`: recordings compared with a model, and the model with what it lacks."""

import argparse
from dataclasses import replace
from io import StringIO
from itertools import permutations

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap

from crash_replay.foreign_text import visible
from crash_replay.output import write_text
from crash_replay.said import say

from ...core.diagnosis import DEFAULT, UNEXPLAINED, Diagnosis, diagnose
from ...core.effects.effect import Effect
from ...core.structure import EffectSpec
from ...core.structure_parts import NOTHING
from ...diagnosis_doubt import doubt
from ...diagnosis_tables import diagnosis_tables
from ...model_file import load_model
from ...ready_models import model_path
from ..common import check_written, effects_of, read_crash, write_json


def run(arguments: argparse.Namespace) -> None:
    check_written(arguments, *arguments.bags, json=arguments.json, apply=arguments.apply)
    effects = effects_of(arguments)
    structure = load_model(arguments.model, effects)
    recordings = [read_crash(bag) for bag in arguments.bags]
    found = diagnose(structure, recordings, effects, arguments.good_enough or DEFAULT, arguments.time_limit)
    if arguments.json:  # files before words: `| head` ends this at a line that nobody reads
        write_json(arguments.json, found.as_json())
    believed = found.verdict != UNEXPLAINED or arguments.apply_unexplained
    applied = found if believed else replace(found, structure=structure, steps=())
    added = apply(applied, structure.effects, effects, arguments.model, arguments.apply) if arguments.apply else ""
    say("\n".join(line for line in (found.text, doubt(found)) if line))
    say(f"\n{diagnosis_tables(found)}")
    if arguments.apply:
        why = "" if believed else "; what explains part of it only is added by --apply-unexplained"
        say(f"\n{visible(arguments.apply)}: {visible(arguments.model)} with {added or 'nothing added'}{why}")


def apply(found: Diagnosis, had: tuple[EffectSpec, ...], effects: dict[str, Effect], model: str, target: str) -> str:
    """Write the model's file, comments and all, with the added effects at its end -> what was added."""
    yaml = YAML()
    content = yaml.load(model_path(model).read_text(encoding="utf-8"))
    unloading = {
        spec.target for spec in found.structure.effects if effects[spec.type].replaces(spec.variant) == "unloading"
    }
    for element in found.structure.elements:
        if not element.damper_pulls:
            content["elements"][element.name]["damper_pulls"] = False
        if element.acts_when_spent != NOTHING and (element.unloads or element.name in unloading):
            content["elements"][element.name]["acts_when_spent"] = element.acts_when_spent
    added = found.structure.effects[len(had) :]
    if added:
        content.setdefault("effects", [])
    for spec, step in zip(added, found.effects_added, strict=True):
        entry = _entry(spec, effects[spec.type], list(content["bodies"]))
        if "coefficient" in entry:
            replaces = effects[spec.type].replaces(spec.variant)
            instead = f", takes the place of the element's {replaces}" if replaces else ""
            entry.yaml_add_eol_comment(f"+- {step.std:.2g} {step.unit}{instead}", "coefficient")
        content["effects"].append(entry)
    text = StringIO()
    yaml.dump(content, text)
    write_text(target, text.getvalue())
    return ", ".join(f"{spec.type} on {spec.target}" for spec in added)


def _entry(spec: EffectSpec, effect: Effect, bodies: list[str]) -> CommentedMap:
    key = effect.target_key(spec.variant)
    entry = CommentedMap({"type": spec.type, key: spec.target})
    if key == "between":
        pair = next(p for p in permutations(bodies, 2) if "-".join(map(visible, p)) == spec.target)
        entry[key] = list(pair)
    if spec.coefficient is not None:
        entry["coefficient"] = float(f"{spec.coefficient:.6g}")
    if spec.shape:
        entry["shape"] = {name: float(f"{value:.6g}") for name, value in spec.shape.items()}
    more = {"host": spec.host, "touches": spec.touches, "taken_from": spec.taken_from, "form": spec.variant}
    entry.update({name: value for name, value in more.items() if value})
    return entry
