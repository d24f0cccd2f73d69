"""Files are written whole or not at all, and never onto what the same command reads: every command that writes."""

import errno
import os
import resource
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from helpers_paths import BAGS

from crash_estimator.cli import diagnose, estimate, report, simulate
from crash_replay import import_command, output
from crash_replay.output import OutputError, check_outputs, write_text, written, written_into

OWN = """
from crash_estimator.core.effects.base import ElementForce
EFFECT = ElementForce("own", "N", force=lambda motion: motion.rate)
"""
CSV = "channels:\n  car_ax: {quantity: acceleration, unit: g, body: car, axis: x}\n"


def full(*_):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def names(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*")}


class TestWriting:
    def test_what_is_there_is_replaced_at_once_and_nothing_is_left_beside(self, tmp_path):
        file = tmp_path / "new" / "a.txt"
        write_text(file, "one")
        write_text(file, "two")
        assert file.read_text() == "two" and names(tmp_path) == {"new", "new/a.txt"}

    @pytest.mark.parametrize("of, step", [(output.os, "fsync"), (Path, "write_bytes"), (Path, "replace")])
    def test_on_a_full_disk_the_older_file_stays(self, tmp_path, monkeypatch, of, step):
        file = tmp_path / "a.txt"
        write_text(file, "older")
        monkeypatch.setattr(of, step, full)
        with pytest.raises(OutputError, match=rf"^{file}: cannot be written: No space left on device$"):
            write_text(file, "newer")
        monkeypatch.undo()
        assert file.read_text() == "older" and names(tmp_path) == {"a.txt"}

    def test_what_fails_or_is_interrupted_leaves_nothing(self, tmp_path):
        for raised in (KeyboardInterrupt, MemoryError):
            with pytest.raises(raised), written(tmp_path / "a.txt") as file:
                file.write_text("half of")
                raise raised
        assert names(tmp_path) == set()

    def test_a_new_file_has_the_permissions_of_any_new_file_and_an_older_one_keeps_its_own(self, tmp_path):
        before = os.umask(0o027)
        try:
            for name in ("new", "private"):
                write_text(tmp_path / name, "one")
            (tmp_path / "private").chmod(0o600)
            write_text(tmp_path / "private", "two")
        finally:
            os.umask(before)
        assert [(tmp_path / name).stat().st_mode & 0o777 for name in ("new", "private")] == [0o640, 0o600]

    def test_a_link_stays_and_what_it_names_is_written(self, tmp_path):
        (tmp_path / "there").mkdir()
        (tmp_path / "link").symlink_to("there/file")
        write_text(tmp_path / "link", "one")  # it names nothing yet
        write_text(tmp_path / "link", "two")
        assert (tmp_path / "link").is_symlink() and (tmp_path / "there/file").read_text() == "two"

    def test_a_device_is_written_to_and_not_replaced(self):
        write_text("/dev/null", "nothing")
        assert Path("/dev/null").is_char_device()
        with pytest.raises(OutputError, match="/dev/full: cannot be written: No space left on device"):
            write_text("/dev/full", "something")

    def test_a_folder_takes_the_place_of_a_folder(self, tmp_path):
        for text in ("one", "two"):
            with written(tmp_path / "bag") as folder:
                folder.mkdir()
                (folder / text).write_text(text)
        assert names(tmp_path) == {"bag", "bag/two"}

    def test_files_that_belong_together_come_together_beside_what_else_is_there(self, tmp_path):
        (tmp_path / "notes").write_text("mine")
        (tmp_path / "a").write_text("older")
        with pytest.raises(ZeroDivisionError), written_into(tmp_path) as place:
            (place / "a").write_text("newer")
            raise ZeroDivisionError
        assert (tmp_path / "a").read_text() == "older"
        with written_into(tmp_path) as place:
            (place / "a").write_text("newer")
            (place / "b").write_text("new")
        assert (tmp_path / "a").read_text() == "newer" and names(tmp_path) == {"notes", "a", "b"}
        with pytest.raises(ZeroDivisionError), written_into(tmp_path / "none"):
            raise ZeroDivisionError
        assert not (tmp_path / "none").exists()

    def test_two_outputs_are_two_files(self, tmp_path):
        with pytest.raises(OutputError, match="--json and --apply both name .*x: give two files"):
            check_outputs({"--json": tmp_path / "x", "--apply": tmp_path / "a" / ".." / "x"}, [])


def test_the_viewer_replaces_its_own_recordings_only(tmp_path):
    pytest.importorskip("rerun")
    from crash_estimator.viewer.sinks import Sinks

    shutil.copy(BAGS / "impactor_single.mcap", tmp_path / "test.mcap")
    (tmp_path / "link").symlink_to("test.mcap")
    before = (tmp_path / "test.mcap").read_bytes()
    for name in ("test.mcap", "link"):
        with pytest.raises(OutputError, match=f"{name} is no Rerun recording and is not replaced"):
            Sinks(port=0, rrd=tmp_path / name).open_file()
    assert (tmp_path / "test.mcap").read_bytes() == before
    (tmp_path / "old.rrd").write_bytes(b"RRF2 of another run")
    _, file = Sinks(port=0, rrd=tmp_path / "old.rrd").open_file()
    assert file == tmp_path / "old.rrd"


def test_a_demonstration_writes_into_no_recording(tmp_path):
    from crash_estimator.demo.folder import claim

    (tmp_path / "nhtsa").mkdir()
    with claim(tmp_path, tmp_path / "nhtsa") as folder:
        assert folder == tmp_path / "nhtsa-2"
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="file/test: cannot be written: Not a directory"):
        with claim(tmp_path / "file", Path("test.mcap")):
            pass


@pytest.fixture
def inputs(tmp_path):
    """One of everything that a command may read, with links of both kinds to the bag."""
    there = tmp_path / "inputs"
    (there / "bag").mkdir(parents=True)
    shutil.copy(BAGS / "impactor_single.mcap", there / "test.mcap")
    shutil.copy(BAGS / "impactor_single.mcap", there / "bag" / "bag_0.mcap")
    (there / "symbolic").symlink_to(there / "test.mcap")
    (there / "hard").hardlink_to(there / "test.mcap")
    model = (Path(estimate.__file__).parents[1] / "models" / "impactor_single.yaml").read_text()
    (there / "model.yaml").write_text(model)
    (there / "own.py").write_text(OWN)
    (there / "test.csv").write_text("time,car_ax\n0,1\n0.001,2\n")
    (there / "test.yaml").write_text(CSV)
    (there / "names.yaml").write_text("test: {id: T}\n")
    return there


ON_A_BAG = ["test.mcap", "symbolic", "hard", "model.yaml", "own.py"]
OF_A_CSV = ["test.csv", "test.yaml", "names.yaml"]
COMMON = ["{}/test.mcap", "--model", "{}/model.yaml", "--effects", "{}/own.py"]
IN_A_FOLDER = ["{}/bag", "--model", "{}/model.yaml"]
IMPORT = ["{}/test.csv", "--names", "{}/names.yaml", "--force"]
WRITING = [
    *((command, COMMON, option, file) for command, option in ((estimate, "--json"), (simulate, "--json"),
      (diagnose, "--json"), (diagnose, "--apply")) for file in ON_A_BAG),
    *((command, IN_A_FOLDER, option, file) for command, option in ((estimate, "--json"), (simulate, "--json"),
      (diagnose, "--json"), (diagnose, "--apply")) for file in ("bag/bag_0.mcap", "bag/new.json")),
    (simulate, [*COMMON, "--from", "{}/bag/bag_0.mcap"], "--json", "bag/bag_0.mcap"),
    (diagnose, ["{}/bag", *COMMON], "--json", "test.mcap"),
    (report, IN_A_FOLDER, "--to", "bag"),
    *((import_command, IMPORT, "--to", file) for file in OF_A_CSV),
    *((import_command, [*IMPORT, "--to", "{}/../b.mcap"], "--json", file) for file in OF_A_CSV),
    (import_command, ["{}/test.mcap", "--force"], "--to", "hard"),
    (import_command, ["{}/bag", "--force"], "--to", "bag"),
]  # fmt: skip


@pytest.mark.parametrize(
    "command, arguments, option, file", WRITING, ids=lambda value: getattr(value, "__name__", str(value))[-20:]
)
def test_no_command_writes_onto_what_it_reads(inputs, capsys, monkeypatch, command, arguments, option, file):
    before = {path: path.read_bytes() for path in inputs.rglob("*") if path.is_file()}
    assert run(monkeypatch, command, *(a.format(inputs) for a in arguments), option, inputs / file) == 1
    said = capsys.readouterr()
    assert said.out == "" and said.err.count("\n") == 1
    assert said.err.startswith(f"error: {option} {inputs / file}") and "this command reads" in said.err
    assert {path: path.read_bytes() for path in inputs.rglob("*") if path.is_file()} == before
    assert not (inputs / "../b.mcap").exists()


def run(monkeypatch, command, *arguments) -> int:
    monkeypatch.setattr(sys, "argv", [command.__name__, *map(str, arguments)])
    try:
        return command.main()
    except SystemExit as ended:
        return ended.code


OF_A_BAG = ["{}/test.mcap", "--model", "{}/model.yaml"]
ON_A_FULL_DISK = [
    (estimate, OF_A_BAG, "--json", "out.json"),
    (simulate, OF_A_BAG, "--json", "out.json"),
    (diagnose, OF_A_BAG, "--json", "out.json"),
    (diagnose, OF_A_BAG, "--apply", "out.yaml"),
    (report, [*OF_A_BAG, "--methods", "rls", "--end", "0.02"], "--to", "out"),
    (import_command, ["{}/test.csv", "--force"], "--to", "out.mcap"),
    (import_command, ["{}/test.csv", "--force"], "--to", "out"),
    (import_command, ["{}/test.csv", "--force", "--to", "{}/../b.mcap"], "--json", "out.json"),
]


@pytest.mark.parametrize(
    "command, arguments, option, name", ON_A_FULL_DISK, ids=lambda value: getattr(value, "__name__", str(value))[-20:]
)
def test_a_full_disk_costs_no_older_file(inputs, capsys, monkeypatch, tmp_path, command, arguments, option, name):
    older = tmp_path / "there" / name
    inside = older / ("report.html" if command is report else "out.mcap") if not older.suffix else older
    inside.parent.mkdir(parents=True)
    inside.write_text("older")
    fsync = os.fsync
    monkeypatch.setattr(output.os, "fsync", lambda file: full() if str(older.parent) in path_of(file) else fsync(file))
    assert run(monkeypatch, command, *(a.format(inputs) for a in arguments), option, older) == 1
    said = capsys.readouterr()
    last = said.err.splitlines()[-1]  # a report tells before how far it is
    assert said.out == "" and last == f"error: {older}: cannot be written: No space left on device"
    assert inside.read_text() == "older"
    assert names(older.parent) == {str(path.relative_to(older.parent)) for path in {older, inside}}


def path_of(file: int) -> str:
    return os.readlink(f"/proc/self/fd/{file}")


def test_a_limit_on_the_size_of_files_is_told(inputs, tmp_path):
    """As the system itself does it, in a process of its own."""
    (tmp_path / "out.json").write_text("older")
    done = of_its_own(
        inputs,
        "--json",
        tmp_path / "out.json",
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (999, 999)),
    )
    assert (
        done.returncode == 1 and done.stderr == f"error: {tmp_path / 'out.json'}: cannot be written: File too large\n"
    )
    assert (tmp_path / "out.json").read_text() == "older" and names(tmp_path) - names(inputs.parent) == set()


def test_files_are_written_though_nobody_reads_on(inputs, tmp_path):
    """As with `| head -1`."""
    reads, writes = os.pipe()
    os.close(reads)
    with open(writes, "wb") as nobody:
        done = of_its_own(inputs, "--json", tmp_path / "out.json", stdout=nobody)
    assert done.returncode == 141 and done.stderr == "", done.stderr
    assert (tmp_path / "out.json").stat().st_size > 10_000


@pytest.mark.parametrize("more", [[], ["--help"]])
def test_standard_output_on_a_full_disk_is_told(inputs, more):
    with open("/dev/full", "wb") as disk:
        done = of_its_own(inputs, *more, stdout=disk)
    assert done.returncode == 1
    assert done.stderr == "error: standard output: cannot be written: No space left on device\n"


def of_its_own(inputs, *arguments, stdout=subprocess.PIPE, **more):
    command = [sys.executable, "-m", "crash_estimator.cli.estimate", inputs / "test.mcap"]
    command += ["--model", inputs / "model.yaml", *arguments]
    return subprocess.run(list(map(str, command)), stdout=stdout, stderr=subprocess.PIPE, text=True, **more)
