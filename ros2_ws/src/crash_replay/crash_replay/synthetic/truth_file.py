"""NAME.truth.yaml beside a simulated recording: what an estimator should find, in SI units."""

from collections.abc import Mapping
from io import StringIO
from typing import Any

from ruamel.yaml import YAML

from .forces import Spring
from .hidden.laws import Carrier
from .scenario import Scenario, Truth
from .system import Body, Element

HEADER = """\
# True values of a simulated recording, SI units. A stiffness curve is the secant stiffness F / X over the crush
# X, constant beyond its ends; between its knots scipy's PchipInterpolator. Forces are compression positive.
"""

HEADER_OF_FORCES = """\
# Here an element's `force` is its static force over the crush; what `hidden` lists comes on top of it.
"""


def truth_text(truth: Truth, more: Mapping[str, Any] | None = None) -> str:
    """The file's text; `more`, such as what is hidden, comes first."""
    scenario = truth.scenario
    content = {
        **(more or {}),
        "scenario": scenario.name,
        "seed": truth.seed,
        "rate": scenario.rate,
        "bodies": {body.name: _body(body) for body in scenario.system.bodies},
        "elements": {element.name: _element(element, truth) for element in scenario.system.elements},
        "channels": _channels(scenario, truth),
    }
    return HEADER + (HEADER_OF_FORCES if more else "") + yaml_text(content)


def yaml_text(content: Mapping[str, Any]) -> str:
    yaml = YAML()
    yaml.default_flow_style = None  # leaves on one line
    yaml.width = 110
    text = StringIO()
    yaml.dump(dict(content), text)
    return text.getvalue()


def _body(body: Body) -> dict[str, Any]:
    if body.motion is None and body.mass is None:
        return {"fixed": True}
    start = {"initial_velocity": body.velocity, "initial_displacement": body.displacement}
    if body.motion is None:
        return {"mass": body.mass} | start
    return start | {"motion": {"time": list(body.motion.time), "velocity": list(body.motion.velocity)}}


def _element(element: Element, truth: Truth) -> dict[str, Any]:
    found = truth.elements[element.name]
    largest = int(abs(found.force).argmax())
    spring = {}
    if isinstance(element.spring, Spring):
        spring = {
            "stiffness": {"crush": list(element.spring.stiffness.x), "value": list(element.spring.stiffness.y)},
            "tension": element.spring.tension and element.spring.unloading is None,
        }
        if element.spring.unloading is not None:
            spring["unloading"] = element.spring.unloading
    if isinstance(element.spring, Carrier):
        spring = element.spring.described()
    spring.setdefault("damping", element.damping)
    return {
        "between": list(element.between),
        **spring,
        "peak": {
            "force": _short(found.force[largest]),
            "time": _short(truth.time_ns[largest] * 1e-9),
            "crush": _short(found.crush[largest]),
        },
    }


def _channels(scenario: Scenario, truth: Truth) -> dict[str, Any]:
    return {
        sensor.channel.name: {
            "unit": sensor.channel.unit,
            "noise": _short(truth.channels[sensor.channel.name].noise),
            "offset": _short(truth.channels[sensor.channel.name].offset),
            "step": _short(sensor.step),
        }
        for sensor in scenario.sensors
    }


def _short(value: float) -> float:
    return float(f"{value:.5g}")
