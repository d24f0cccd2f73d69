"""What a recording or a model calls itself never reaches a terminal, a page or the viewer raw."""

import re
import shutil
import sys
from dataclasses import fields
from pathlib import Path
from types import SimpleNamespace

import helpers_bag
import pytest
import yaml
from helpers_bag import topics_of, write_messages
from helpers_paths import BAGS

from crash_estimator.cli import diagnose, estimate, report, simulate
from crash_estimator.demo.choice import Choice
from crash_estimator.demo.start import _announcement
from crash_estimator.demo.terminal import Terminal
from crash_estimator.model_file import load_model
from crash_estimator.viewer.summary import row
from crash_replay import import_command
from crash_replay.bag import read_bag
from crash_replay.foreign_text import code, code_block, markdown, visible, visible_lines
from crash_replay.message_types import decode_test, encode_test
from crash_replay.recording import Channel, Recording, Test
from crash_replay.synthetic.hidden.cases import draw_case

HOSTILE = "\x1b[31m\x9b2J\u202e\u2028\r\n<script>alert(1)</script><b>|`[x](http://h)![y](z)$**# _e_"


def test_what_does_not_print_is_seen_and_the_rest_is_as_it_is():
    assert visible(HOSTILE).startswith(r"\x1b[31m\x9b2J\u202e\u2028\r\n<script>") and visible(HOSTILE).isprintable()
    assert visible("Größe 25\xa0km/h, 5 µs ± 3 ‰ – 衝突") == "Größe 25 km/h, 5 µs ± 3 ‰ – 衝突"
    assert visible("\udc80.csv") == r"\udc80.csv" and visible(Path("a\nb")) == r"a\nb"
    assert visible_lines("a\tb\nc") == "a\\tb\nc"


def test_a_page_shows_it_as_it_is_written():
    assert markdown("rib_ay, T-1 (left)") == "rib_ay, T-1 (left)"
    assert markdown("<b>|`[x](y)") == r"&lt;b&gt;\|\`\[x\](y)" and markdown("_e_ $a$ **") == r"\_e\_ \$a\$ \*\*"
    assert code("a`<b> < 3") == "`a'‹b> < 3`" and code_block("```\na < 3") == "```\n'''\na < 3\n```"


def raw(recording: Recording) -> SimpleNamespace:
    """The recording with a hostile text in every field: what another program may have written."""
    test = recording.test
    known = [dict(name=c.name, quantity=c.quantity, unit=c.unit, axis=c.axis) for c in test.channels]
    channels = [SimpleNamespace(**one, body=HOSTILE, source=HOSTILE) for one in known]
    channels.append(SimpleNamespace(**vars(channels[0]) | {"name": HOSTILE}))
    velocity = dict(test.initial_velocity) | {HOSTILE: 1.0}
    hostile = SimpleNamespace(id=HOSTILE, title=HOSTILE, source=HOSTILE, channels=channels, notes=[HOSTILE, HOSTILE],
                              initial_velocity=velocity, initial_displacement={HOSTILE: 1.0})  # fmt: skip
    return SimpleNamespace(test=hostile, sample_period=recording.sample_period)


class Raw(SimpleNamespace):
    def __len__(self) -> int:
        return self.samples


def test_a_recording_s_texts_can_be_printed():
    recording = read_bag(BAGS / "impactor_single.mcap")
    message = encode_test(Raw(**vars(raw(recording)), samples=len(recording)), 0)
    test, _, _ = decode_test(bytes(message))
    texts = [test.id, test.title, test.source, *test.notes, *test.initial_velocity, *test.initial_displacement]
    texts += [getattr(channel, field.name) for channel in test.channels for field in fields(Channel)]
    assert len(texts) > 15 and all(text.isprintable() for text in texts)
    assert Test("a\x1b", (), notes=("b\n",)).notes == (r"b\n",)


@pytest.fixture(scope="module")
def hostile(tmp_path_factory):
    """A bag, a model and a CSV whose every text is hostile."""
    folder = tmp_path_factory.mktemp("hostile")
    drawn = draw_case("impactor", ["viscous_damping"], 3100)
    kept = drawn.record(0.75, 1.0)[0]
    others = Raw(**vars(raw(kept)), samples=len(kept))
    encode, helpers_bag.encode_test = helpers_bag.encode_test, lambda _, zero: encode_test(others, zero)
    try:
        write_messages(folder / "bag", kept, topics_of(kept))
    finally:
        helpers_bag.encode_test = encode
    (folder / "model.yaml").write_text(yaml.safe_dump(with_hostile_names(dict(drawn.specimen.model)), sort_keys=False))
    (folder / "test.csv").write_text("time,car_ax\n" + "\n".join(f"{k / 1000},{k % 7}" for k in range(50)))
    quoted = '"' + HOSTILE.encode("unicode_escape").decode() + '"'
    (folder / "test.yaml").write_text(
        f"test: {{id: {quoted}, title: {quoted}, source: {quoted}}}\n"
        f"channels: {{car_ax: {{quantity: acceleration, unit: g, body: {quoted}}}}}\n"
        f"initial_velocity: {{{quoted}: 1.0}}\n"
    )
    return folder


def with_hostile_names(model: dict) -> dict:
    """The same with a hostile end to the names of the model, of its bodies and its elements."""
    names = {model["name"], *model["bodies"], *model["elements"]}

    def renamed(part):
        if isinstance(part, dict):
            return {renamed(key): renamed(value) for key, value in part.items()}
        return [renamed(one) for one in part] if isinstance(part, list) else part + HOSTILE if part in names else part

    return renamed(model)


def run(monkeypatch, capsys, command, *arguments):
    monkeypatch.setattr(sys, "argv", [command.__name__, *map(str, arguments)])
    try:
        status = command.main()
    except SystemExit as ended:
        status = ended.code
    said = capsys.readouterr()
    assert all(line.isprintable() for line in (said.out + said.err).split("\n"))
    return status, said.out, said.err


@pytest.mark.parametrize("command, more", [(estimate, []), (simulate, []), (diagnose, ["--apply", "new.yaml"])])
def test_no_command_prints_it_raw(hostile, monkeypatch, capsys, tmp_path, command, more):
    monkeypatch.chdir(tmp_path)
    arguments = [hostile / "bag", "--model", hostile / "model.yaml", *more, "--json", "out.json"]
    status, out, err = run(monkeypatch, capsys, command, *arguments)
    assert status == 0, err
    assert r"\x1b[31m" in out and (tmp_path / "out.json").read_text().isascii()
    if more:
        assert "viscous_damping" in (tmp_path / "new.yaml").read_text()
        assert load_model(tmp_path / "new.yaml").name.isprintable()


def test_an_import_prints_and_keeps_it_so_that_it_can_be_printed(hostile, monkeypatch, capsys, tmp_path):
    for source in ("bag", "test.csv"):
        status, out, err = run(
            monkeypatch, capsys, import_command, hostile / source, "--to", tmp_path / f"{source}.mcap"
        )
        assert status == 0 and r"\x1b[31m" in out, err
        assert read_bag(tmp_path / f"{source}.mcap").test.title.isprintable()


def test_a_report_is_a_page_and_no_more(hostile, monkeypatch, capsys, tmp_path):
    pytest.importorskip("matplotlib")
    arguments = [hostile / "bag", "--model", hostile / "model.yaml", "--to", tmp_path, "--methods", "rls", "--markdown"]
    status, out, err = run(monkeypatch, capsys, report, *arguments)
    assert status == 0, err
    page = (tmp_path / "report.md").read_text()
    assert r"x1b" in page and all(line.isprintable() for line in page.split("\n"))
    prose = re.sub(r"```.*?```|`[^`\n]*`", "", page, flags=re.DOTALL)
    assert "<" not in page and "[x](" not in prose and "![y]" not in prose and "**#" not in prose
    tables = re.findall(r"(?:^\|.*\n)+", page.replace(r"\|", ""), re.MULTILINE)
    for table in tables:
        assert len({line.count("|") for line in table.splitlines()}) == 1, "a name makes no column"
    assert tables


def test_a_demonstration_announces_it_on_lines_of_its_own(hostile, capsys):
    recording = read_bag(hostile / "bag")
    choice = Choice("kalman", str(hostile / "\x1b[2J.yaml"), "kalman")
    for line in _announcement(recording, hostile / "bag", [choice], 1.0, True):
        Terminal().say(line)
    said = capsys.readouterr().out.split("\n")
    assert len(said) == 5 and all(line.isprintable() for line in said)


def test_the_viewer_s_tables_hold_no_markup_but_their_own():
    assert row("a|b", ["<b>", "rib_ay"]) == r"| a\|b | &lt;b&gt; | rib_ay |"


@pytest.mark.parametrize("command", [estimate, diagnose, simulate])
def test_no_error_says_it_raw(hostile, monkeypatch, capsys, tmp_path, command):
    folder = tmp_path / "\x1b]0;title\x07"
    folder.mkdir()
    shutil.copy(hostile / "model.yaml", folder / "model.yaml")
    shutil.copy(hostile / "test.csv", folder / "foreign\n.mcap")
    (folder / "broken.yaml").write_text((folder / "model.yaml").read_text().replace("mass:", '"\\e[31m":'))
    for bag, model in ((hostile / "bag", folder / "none.yaml"), (folder / "none.mcap", folder / "model.yaml"),
                       (folder / "foreign\n.mcap", folder / "model.yaml"), (hostile / "bag", "side_dummy"),
                       (hostile / "bag", folder / "broken.yaml"), (hostile / "bag", "\x1b[31m")):  # fmt: skip
        status, out, err = run(monkeypatch, capsys, command, bag, "--model", model)
        assert status == 1 and out == "" and err.startswith("error: ") and err.count("\n") == 1, err
