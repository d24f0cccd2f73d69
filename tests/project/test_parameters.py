"""Parameters of the nodes: one table each, which the README has, and which the running nodes keep to."""

import os
import subprocess
import sys
from dataclasses import fields

import pytest
from helpers_domain import own_domain
from helpers_parameters import TABLES, tables
from helpers_paths import ROOT
from helpers_readme import README
from helpers_waiting import PATIENCE

from crash_estimator.core.methods import METHODS
from crash_estimator.nodes.estimator_parameters import PREFIX, SETTINGS, settings_in, settings_of
from crash_replay.node_parameters import checked

OF_REPLAY = ("replay", "record")
MODULES = {n: f"crash_{'replay' if n in OF_REPLAY else 'estimator.nodes'}.{n}_node" for n in TABLES}
BY_THE_CALLER = {"settings", "start", "members"}
"""Fields of a method that are no settings: the structure's, another pass's noise models, what is made of the others."""


def test_the_readme_has_the_tables_as_they_are_declared():
    """Made by `tools/env python tests/helpers_parameters.py`."""
    start = README.index("| parameter of `replay`")
    assert README[start : README.index("\n### ", start)].rstrip() == tables()


def test_every_one_has_a_meaning_and_a_default_that_it_may_have():
    for table in (*TABLES.values(), *map(settings_of, METHODS)):
        for name, allowed in table.items():
            assert allowed.meaning and len(allowed.meaning) < 250, name
            assert checked(table, name, allowed.default) == allowed.default


@pytest.mark.parametrize("method", METHODS)
def test_every_setting_of_a_method_is_a_parameter(method):
    """With its default, of its kind: nothing is left to the code that the table does not say."""
    recipe, table = METHODS[method], settings_of(method)
    of_class = {f.name: f.default for f in fields(recipe.kind) if f.name not in BY_THE_CALLER} | recipe.settings
    assert set(SETTINGS[recipe.kind]) == set(of_class)
    defaults = settings_in({name: allowed.default for name, allowed in table.items()})
    assert defaults | of_class == defaults
    assert {name.removeprefix(PREFIX) for name in table} - set(of_class) <= {"damping_after", "preset"}


@pytest.mark.parametrize("method", METHODS)
def test_a_preset_sets_the_defaults_and_no_more(method):
    """Each is a setting that the method has; what a preset leaves alone is as without it."""
    ours, printed = settings_of(method), settings_of(method, "thesis")
    changed = {name.removeprefix(PREFIX) for name in ours if ours[name] != printed[name]} - {"preset"}
    assert changed == {name for name, value in METHODS[method].thesis.items() if value != ours[PREFIX + name].default}
    for name, allowed in printed.items():
        assert checked(printed, name, allowed.default) == allowed.default


@pytest.mark.parametrize("node", TABLES)
def test_a_name_that_there_is_not_ends_a_node_with_one_line(node):
    name = next(iter(TABLES[node]))
    command = [sys.executable, "-m", MODULES[node], "--ros-args", "-p", f"{name}s:=1.0"]
    environment = os.environ | {"ROS_DOMAIN_ID": str(own_domain())}
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, env=environment, cwd=ROOT)
    assert (done.returncode, done.stdout) == (1, "")
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"error: there is no parameter {name}s: ") and name in line.partition(": ")[2]
