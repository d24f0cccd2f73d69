"""A node as a command: its help says all that it takes."""

import sys

import pytest

from crash_estimator.nodes import diagnosis_command, estimator_command, viewer_command
from crash_replay import record_command, replay_command


@pytest.mark.parametrize(
    "command", [diagnosis_command, estimator_command, record_command, replay_command, viewer_command]
)
def test_the_help_of_a_node_lists_its_parameters(command, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["node", "--help"])
    assert command.main() == 0
    said = capsys.readouterr().out
    assert command.__doc__.strip() in said
    rows = {line.split()[0]: line for line in said.partition("parameters:\n")[2].splitlines() if line[2] != " "}
    assert list(rows) == list(command.PARAMETERS)


def test_the_help_says_what_a_parameter_means_and_is_by_default(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["replay", "-h"])
    replay_command.main()
    said = capsys.readouterr().out
    assert "times real time; may be set at any time; default 1\n" in said and "; default false\n" in said
