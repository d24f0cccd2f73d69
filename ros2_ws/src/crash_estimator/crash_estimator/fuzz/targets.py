"""What takes input from outside: how a valid one is spoilt, and the very functions that commands and nodes take it
by."""

import json
from collections.abc import Callable
from dataclasses import fields
from functools import partial
from pathlib import Path
from random import Random
from typing import NamedTuple

import numpy as np
from crash_msgs.msg import TestInfo
from crash_msgs.srv import AddEffect

from crash_replay.channel_messages import decode
from crash_replay.limits import most_samples
from crash_replay.node_parameters import checked
from crash_replay.readers import read_source
from crash_replay.recording import Channel, Test
from crash_replay.replay_parameters import PARAMETERS as REPLAY
from crash_replay.ros_messages import channel_to_msg, decoded, stamp, test_from_msg

from ..cli.common import parse_settings
from ..core.effects import EFFECTS
from ..core.effects.effect import ElementMotion
from ..core.effects.user import load_effects
from ..core.methods import METHODS, make_estimator
from ..following.alignment import Alignment
from ..kept import Kept
from ..model_file import load_model
from ..nodes.diagnosis_parameters import PARAMETERS as DIAGNOSIS
from ..nodes.effect_requests import with_effect
from ..nodes.estimator_model import EstimatorModel
from ..nodes.estimator_parameters import PARAMETERS as ESTIMATOR
from ..nodes.estimator_parameters import settings_of
from ..nodes.samples import received, rows_of, what_is_wrong
from ..nodes.viewer_messages import BLOCK_OF, FINDING_OF, test_block
from ..nodes.viewer_parameters import PARAMETERS as VIEWER
from . import live
from .bags import spoilt_bag
from .mutations import FLOATS, INTEGERS, NUMBERS, PYTHON, WORDS, spoilt, spoilt_message
from .valid import (
    CSV,
    EFFECT,
    EV5,
    MME,
    MODEL,
    NAMED,
    OUTPUT,
    RECORDING,
    SAMPLES,
    TEST_INFO,
    TIME_ZERO,
    Files,
    cdr,
)  # fmt: skip


class Target(NamedTuple):
    share: int  # of the inputs, relative to the others'
    spoil: Callable[[Random], Files]
    take: Callable[[Path], None]  # the folder with the files; may raise the project's own errors
    prepare: Callable[[], object] = lambda: None  # before the first, however long it takes


def _read(name: str, **more: str) -> Callable[[Path], None]:
    def take(folder: Path) -> None:
        read_source(folder / name, **{option: folder / file for option, file in more.items()})

    return take


def _take_bag(folder: Path) -> None:
    for recover in (False, True):
        try:
            read_source(folder / "small.mcap", recover=recover)
        except Exception:
            if recover:
                raise


def _take_test(folder: Path) -> None:
    message = decoded((folder / "test").read_bytes(), TestInfo)
    test = test_from_msg(message)
    test_block(message)
    Kept(test)
    Alignment(test, message.sample_period, lambda renumbered: None, lambda rows: None)


def _take_samples(folder: Path) -> None:
    kept = Kept(RECORDING.test)
    for raw in (cdr(SAMPLES), (folder / "samples").read_bytes()):
        message = received(raw)
        if what_is_wrong(message, kept, most_samples(len(RECORDING.test.channels))):
            return
        kept.put_rows(rows_of(message))
    kept.until(kept.end)
    kept.gap(0, kept.end)


CHANNEL_MESSAGES = [
    channel_to_msg(channel, stamp(TIME_ZERO), RECORDING.values.item(12, k))
    for k, channel in enumerate(RECORDING.test.channels)
]


def _spoil_channel(rng: Random) -> Files:
    k = rng.randrange(len(CHANNEL_MESSAGES))
    return {str(k): spoilt_message(rng, CHANNEL_MESSAGES[k])}


def _take_channel(folder: Path) -> None:
    (file,) = folder.iterdir()
    decode(RECORDING.test.channels[int(file.name)], [file.read_bytes()])


def _spoil_output(rng: Random) -> Files:
    topic = rng.choice(list(OUTPUT))
    return {topic.replace("/", "."): spoilt_message(rng, OUTPUT[topic])}


def _take_output(folder: Path) -> None:
    (file,) = folder.iterdir()
    topic = file.name.replace(".", "/")
    kind, make = {**BLOCK_OF, **FINDING_OF}.get(topic, (type(OUTPUT[topic]), None))
    message = decoded(file.read_bytes(), kind)
    if topic in FINDING_OF:
        make(message)
    elif make:
        make("mrls", message)


SETTING = {name: one for method in METHODS for name, one in settings_of(method).items()}
NODES = {"estimator": ESTIMATOR | SETTING, "diagnosis": DIAGNOSIS, "viewer": VIEWER, "replay": REPLAY}
SETTINGS = sorted({f.name for recipe in METHODS.values() for f in fields(recipe.kind)} | {"damping_after", "no_such"})


def _spoil_parameter(rng: Random) -> Files:
    if rng.random() < 0.5:
        setting = f"{rng.choice(SETTINGS)}{rng.choice(('=', '=', '=', '', '=='))}{rng.choice((*NUMBERS, *WORDS))}"
        return {"parameter.json": json.dumps({"method": rng.choice([*METHODS, "krls"]), "setting": setting}).encode()}
    node = rng.choice(list(NODES))
    values = (*WORDS, *NUMBERS, *FLOATS, *INTEGERS, True, False, None, [], [1], ["a", "b"], ["a", 1], {"a": 1}, [[]])
    given = {"node": node, "name": rng.choice(list(NODES[node])), "value": rng.choice(values)}
    return {"parameter.json": json.dumps(given).encode()}


def _take_parameter(folder: Path) -> None:
    given = json.loads((folder / "parameter.json").read_bytes())
    if "node" in given:
        checked(NODES[given["node"]], given["name"], given["value"])
        return
    make_estimator(
        load_model("frontal_single"), _test_of_model(), given["method"], **parse_settings([given["setting"]])
    )


def _test_of_model() -> Test:
    channels = {name: Channel(name, quantity) for _, name, quantity in load_model("frontal_single").channels()}
    return Test("t", tuple(channels.values()))


def _take_model(folder: Path) -> None:
    """As a node does, which tries it on a sample."""
    structure = load_model(folder / "model.yaml", EFFECTS)
    method = list(METHODS)[len(structure.name) % len(METHODS)]
    EstimatorModel(structure, method, {}, EFFECTS).try_out()


def _take_effect(folder: Path) -> None:
    time = np.linspace(0.0, 0.3, 200)
    for effect in load_effects(folder / "mine.py").values():
        motion = ElementMotion(time, np.sin(40.0 * time), np.cos(40.0 * time), np.ones(200), 1e5 * time)
        if effect.function:
            shapes = {name: shape.starts[-1] for name, shape in effect.shapes.items()}
            with np.errstate(all="ignore"):
                effect.along(motion, **shapes)


REQUEST = AddEffect.Request(effect="coulomb_friction", target="rib_spine", options=["coefficient=1810", "speed=0.1"])


def _take_request(folder: Path) -> None:
    with_effect(load_model("side_dummy"), decoded((folder / "request").read_bytes(), AddEffect.Request))


TARGETS: dict[str, Target] = {
    "CSV and YAML": Target(20, lambda rng: spoilt(rng, CSV), _read("rib.csv")),
    "names file": Target(
        6, lambda rng: {**CSV, **spoilt(rng, {"names.yaml": NAMED["names.yaml"]})}, _read("rib.csv", names="names.yaml")
    ),
    "EV5 folder": Target(20, lambda rng: spoilt(rng, EV5), _read(".")),
    "ISO-MME folder": Target(20, lambda rng: spoilt(rng, MME), _read(".")),
    "bag": Target(20, spoilt_bag, _take_bag),
    "bag folder": Target(5, lambda rng: spoilt_bag(rng) | {"metadata.yaml": b""}, _read(".")),
    "TestInfo": Target(15, lambda rng: {"test": spoilt_message(rng, TEST_INFO)}, _take_test),
    "Samples": Target(15, lambda rng: {"samples": spoilt_message(rng, SAMPLES)}, _take_samples),
    "channel messages": Target(8, _spoil_channel, _take_channel),
    "output of other nodes": Target(15, _spoil_output, _take_output),
    "parameters": Target(12, _spoil_parameter, _take_parameter),
    "model file": Target(20, lambda rng: spoilt(rng, MODEL), _take_model),
    "effects file": Target(12, lambda rng: spoilt(rng, EFFECT, (*PYTHON, *PYTHON, *WORDS)), _take_effect),
    "effect requests": Target(6, lambda rng: {"request": spoilt_message(rng, REQUEST)}, _take_request),
    "estimator node": Target(8, live.spoil, partial(live.take, "estimator"), partial(live.node, "estimator")),
    "diagnosis node": Target(8, live.spoil, partial(live.take, "diagnosis"), partial(live.node, "diagnosis")),
}
