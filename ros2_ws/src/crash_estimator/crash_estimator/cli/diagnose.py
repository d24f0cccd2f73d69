"""`diagnose RECORDING [RECORDING ...] --model M`: which physical effect is missing from a model, by recordings of it."""

import argparse
import sys
from dataclasses import replace
from io import StringIO
from itertools import permutations

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap

from crash_replay.fault import guarded
from crash_replay.foreign_text import visible
from crash_replay.output import write_text
from crash_replay.said import Parser, say

from ..core.diagnosis import DEFAULT, UNEXPLAINED, Diagnosis, Tolerance, diagnose, tolerance_of
from ..core.effects.effect import Effect
from ..core.structure import EffectSpec, ModelError
from ..diagnosis_doubt import doubt
from ..diagnosis_tables import diagnosis_tables
from ..model_file import load_model, model_path, ready_models
from .common import RECORDING, add_effects_option, add_time_limit, check_written, effects_of, read_crash, write_json


def main() -> None:
    sys.exit(guarded(lambda: run(_parser().parse_args())))


def _parser() -> Parser:
    parser = Parser(prog="diagnose", description=__doc__)
    parser.add_argument(
        "bags", nargs="+", metavar="RECORDING",
        help=f"recordings of one structure, best at different speeds; each is {RECORDING}",
    )  # fmt: skip
    parser.add_argument("--model", required=True, help=f"a .yaml file, or one of {', '.join(ready_models())}")
    parser.add_argument("--apply", metavar="NEW_MODEL.yaml", help="write the model with the effects that were found")
    parser.add_argument(
        "--apply-unexplained", action="store_true", help="with --apply: also what explains part of it only"
    )
    parser.add_argument(
        "--good-enough", metavar="RATING|PERCENT%", type=_tolerance, default=DEFAULT,
        help="what may be left in every channel: an ISO/TS 18571 rating, as in 0.8, or an RMS as a share of the peak, "
        "as in 5%%; a model that is as good is adequate as it is. Default: 1%% completes an explanation, no more",
    )  # fmt: skip
    parser.add_argument("--json", metavar="FILE", help="write everything that was found")
    add_time_limit(parser)
    add_effects_option(parser)
    return parser


def _tolerance(text: str) -> Tolerance:
    try:
        return tolerance_of(text)
    except ModelError as error:  # argparse says what its own errors say
        raise argparse.ArgumentTypeError(str(error)) from None


def run(arguments: argparse.Namespace) -> None:
    check_written(arguments, *arguments.bags, json=arguments.json, apply=arguments.apply)
    effects = effects_of(arguments)
    structure = load_model(arguments.model, effects)
    recordings = [read_crash(bag) for bag in arguments.bags]
    found = diagnose(structure, recordings, effects, arguments.good_enough, arguments.time_limit)
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
    for element in found.structure.elements:
        if not element.damper_pulls:
            content["elements"][element.name]["damper_pulls"] = False
    added = found.structure.effects[len(had) :]
    if added:
        content.setdefault("effects", [])
    for spec, step in zip(added, found.steps):
        entry = _entry(spec, effects[spec.type], list(content["bodies"]))
        if "coefficient" in entry:
            replaces = effects[spec.type].replaces
            instead = f", takes the place of the element's {replaces}" if replaces else ""
            entry.yaml_add_eol_comment(f"+- {step.std:.2g} {step.unit}{instead}", "coefficient")
        content["effects"].append(entry)
    text = StringIO()
    yaml.dump(content, text)
    write_text(target, text.getvalue())
    return ", ".join(f"{spec.type} on {spec.target}" for spec in added)


def _entry(spec: EffectSpec, effect: Effect, bodies: list[str]) -> CommentedMap:
    key = effect.acts_on
    entry = CommentedMap({"type": spec.type, key: spec.target})
    if key == "between":
        pair = next(p for p in permutations(bodies, 2) if "-".join(map(visible, p)) == spec.target)
        entry[key] = list(pair)
    if spec.coefficient is not None:
        entry["coefficient"] = float(f"{spec.coefficient:.6g}")
    if spec.shape:
        entry["shape"] = {name: float(f"{value:.6g}") for name, value in spec.shape.items()}
    more = ("host", "touches", "taken_from", "variant")
    entry.update({name: value for name in more if (value := getattr(spec, name))})
    return entry


if __name__ == "__main__":
    main()
