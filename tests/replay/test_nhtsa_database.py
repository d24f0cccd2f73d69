"""`nhtsa:NUMBER` against a server that answers as NHTSA's does: packages, curves, faults, limits, the cache."""

import subprocess
import sys
from dataclasses import replace
from socket import socket

import numpy as np
import pytest
from helpers_ev5 import two_cars, write_two_cars
from helpers_nhtsa_server import Database, client_of, packed, served
from helpers_uds import CODES, write_uds
from numpy.testing import assert_allclose, assert_array_equal

from crash_replay import limits
from crash_replay.bag import read_bag
from crash_replay.import_command import main
from crash_replay.nhtsa_database.by_number import folder_of
from crash_replay.readers import name_of, read_source
from crash_replay.recording import RecordingError

NUMBER = 7292


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write_two_cars(tmp_path_factory.mktemp("ev5") / "made", NUMBER, two_cars()[:4])


@pytest.fixture(scope="module")
def expected(folder):
    return read_source(folder)


@pytest.fixture
def database(folder, tmp_path, monkeypatch):
    database = Database(folder, NUMBER)
    with served(database) as url:
        monkeypatch.setenv("CRASH_CACHE", str(tmp_path / "cache"))
        monkeypatch.setenv("CRASH_NHTSA_API", f"{url}/api")
        monkeypatch.setenv("CRASH_NHTSA_CURVES", f"{url}/tsv")
        monkeypatch.setenv("no_proxy", "127.0.0.1")
        database.waited = []
        database.client = client_of(url, database.waited)
        yield database


def fetched(database):
    return read_source(folder_of(f"nhtsa:{NUMBER}", database.client))


def same(one, other, rtol=0.0):
    assert one.test.channel_names == other.test.channel_names
    assert [c.body for c in one.test.channels] == [c.body for c in other.test.channels]
    assert one.test.initial_velocity == other.test.initial_velocity
    assert_array_equal(one.time_ns, other.time_ns)
    assert_allclose(one.values, other.values, rtol=rtol, atol=1e-6 if rtol else 0.0)


def test_a_package_is_fetched_once_and_kept(database, expected, tmp_path, capsys):
    same(read_source(f"nhtsa:{NUMBER}"), expected)
    assert "nhtsa:7292: asking NHTSA's database" in capsys.readouterr().err
    asked = list(database.asked)
    assert len(asked) == 2 and all("crash_replay" in agent for _, _, agent in asked)
    assert main([f"nhtsa:{NUMBER}", "--to", str(tmp_path / "b.mcap")]) == 0  # the command as it is typed
    assert database.asked == asked, "the second time nothing is asked"
    same(read_bag(tmp_path / "b.mcap"), expected)
    assert [path.name for path in (tmp_path / "cache").iterdir() if path.is_dir()] == ["v07292"]


def test_errors_and_silence_are_waited_out_longer_each_time(database, expected):
    database.faults = {"vehicle-documents": [500, "silent", 503], "/files/": [429]}
    same(fetched(database), expected)
    assert database.waited == [2.0, 4.0, 8.0, 2.0]


def test_a_download_that_breaks_off_goes_on_where_it_was(database, expected):
    database.faults = {"/files/": ["cut"]}
    same(fetched(database), expected)
    ranges = [asked for path, asked, _ in database.asked if path.startswith("/files/")]
    assert ranges == ["", f"bytes={len(database.package) // 2}-"]


def test_so_it_does_in_another_session(database, expected, tmp_path):
    database.faults = {"/files/": ["cut", 500, 500, 500]}
    with pytest.raises(RecordingError, match=r"nhtsa:7292: .* no answer in 4 attempts .* is kept and gone on with"):
        fetched(database)
    assert (tmp_path / "cache/v07292.zip").stat().st_size == len(database.package) // 2
    same(fetched(database), expected)
    assert database.asked[-1][1] == f"bytes={len(database.package) // 2}-"


@pytest.mark.parametrize("fault", ["missing", "none named", "truncated", "rotten", "bomb", "no header"])
def test_without_a_package_that_can_be_used_it_comes_curve_by_curve(
    database, expected, folder, tmp_path, capsys, fault, monkeypatch
):
    whole = database.package
    if fault == "missing":
        database.faults = {"/files/": [404]}
    elif fault == "none named":
        database.documents = lambda url: [{"evFiles": None, "tdmsFiles": [f"{url}/files/tdms.zip"]}]
    elif fault == "truncated":
        database.package = whole[: len(whole) // 2]
    elif fault == "rotten":
        middle = len(whole) // 2
        database.package = whole[:middle] + bytes(64) + whole[middle + 64 :]
    elif fault == "bomb":
        monkeypatch.setattr(limits, "UNPACKED_SMALL", 1_000_000)
        database.package = packed(folder, {"v07292.777": b"0" * 60_000_000})
    else:
        database.package = packed(tmp_path, {"readme.txt": b"nothing"})
    same(fetched(database), expected, rtol=1e-7)
    assert "curve by curve instead" in capsys.readouterr().err
    assert sum(file.stat().st_size for file in (tmp_path / "cache").rglob("*")) < 5_000_000


def test_curves_that_have_come_are_not_asked_again(database, expected):
    database.faults = {"/files/": [404, 404], "tsv.003": [500] * 4}
    with pytest.raises(RecordingError, match="no answer"):
        fetched(database)
    before = len(database.asked)
    same(fetched(database), expected, rtol=1e-7)
    assert not any("tsv.001" in path or "tsv.002" in path for path, *_ in database.asked[before:])


def test_commands_that_fetch_nothing_do_not_wait_for_the_http_library():
    """It takes a tenth of a second to import: `--help` and a recording from a file go without."""
    code = "import sys, crash_replay.readers, crash_replay.import_command; assert 'requests' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


@pytest.mark.parametrize("one_column", [False, True])
def test_header_from_the_answers_about_each_curve(database, expected, one_column):
    database.faults = {"/files/": [404]}
    database.one_column = one_column
    database.metadata["INSTRUMENTATION"] = None
    recording = fetched(database)
    for name in ("vehicle1_driver_head_ax", "vehicle1_left_sill_ax"):
        assert_allclose(recording.column(name), expected.column(name), rtol=1e-7, atol=1e-6)
    assert_array_equal(recording.time_ns, expected.time_ns)


def test_a_missing_curve_costs_only_itself(database, expected):
    database.faults = {"/files/": [404], "tsv.002": [404]}
    recording = fetched(database)
    assert "vehicle1_driver_chest_ax" not in recording.test.channel_names
    assert any("no data file: curves 2" in note for note in recording.test.notes)


def test_rows_of_url_and_document_type(database, expected):
    database.documents = lambda url: [
        {"url": f"{url}/files/report.pdf", "documentType": "Report"},
        {"url": f"{url}/other/video.zip", "documentType": "Preview video"},
        {"url": f"{url}/files/v07292ev5.zip", "documentType": "EV5 data"},
    ]
    same(fetched(database), expected)


def test_a_package_of_uds_files_where_there_is_none_in_ev5_form(database, expected, tmp_path):
    records = [("|".join(CODES.get(part, part) for part in record.split("|")), values) for record, values in two_cars()]
    database.package = packed(write_uds(tmp_path / "uds", [*records[:3], records[9]]))
    database.documents = lambda url: [{"evFiles": None, "udsFiles": [f"{url}/files/uds.zip"], "tdmsFiles": ["t.zip"]}]
    recording = fetched(database)
    for name in ("vehicle1_driver_head_ax", "vehicle1_driver_chest_ax"):
        assert_allclose(recording.column(name), expected.column(name), rtol=1e-4, atol=1e-3)


def test_paths_in_a_package_lead_nowhere_else(database, expected, folder, tmp_path):
    database.package = packed(folder, {"../../v07292.998": b"0 1\n", "/etc/v07292.999": b"0 1\n"})
    same(fetched(database), expected)
    assert not (tmp_path / "v07292.998").exists()
    assert (tmp_path / "cache/v07292/v07292.998").exists()


def test_what_is_wrong_is_one_line(database, monkeypatch):
    def error(source):
        with pytest.raises(RecordingError) as raised:
            read_source(source)
        assert "\n" not in str(raised.value)
        return str(raised.value)

    for source in ("nhtsa:", "nhtsa:v10146", "nhtsa:0", "nhtsa:123456", "nhtsa:../x"):
        assert error(source).startswith(f"{source}: expected nhtsa:NUMBER")
    assert error("nhtsa:7293") == "nhtsa:7293: NHTSA's database has no vehicle test of this number"
    database.documents = lambda url: [{"evFiles": ["https://elsewhere.example/v07292.zip"]}]
    assert "not on a host of NHTSA's" in error(f"nhtsa:{NUMBER}")
    database.faults = {"vehicle-documents": ["html"]}
    assert "expected JSON with `results`, found b'<html>" in error(f"nhtsa:{NUMBER}")
    monkeypatch.setenv("CRASH_CACHE", "/dev/null/cache")
    with pytest.raises(Exception, match="cannot be written"):
        read_source(f"nhtsa:{NUMBER}")


def test_a_server_that_is_not_there_is_said_in_a_few_words(database, monkeypatch):
    """Not in the library's own message, with the URL in it three times; a wrong address is not tried again."""
    with socket() as nobody:
        nobody.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{nobody.getsockname()[1]}/api"
    for api, said in ((url, r"no answer in 4 attempts \(\[Errno 111\] Connection refused\): try again later; what"),
                      ("elsewhere", r"no answer in 1 attempt \(Invalid URL 'elsewhere/")):  # fmt: skip
        client = replace(database.client, api=api)
        with pytest.raises(RecordingError, match=f"^nhtsa:7292: {api}/.*: {said}"):
            folder_of(f"nhtsa:{NUMBER}", client)


def test_a_redirection_is_followed_on_the_databases_hosts_alone(database, expected):
    database.moved = {"/files/v07292ev5.zip": "/files/elsewhere/v07292ev5.zip"}
    same(fetched(database), expected)


def test_a_redirection_elsewhere_is_not(database):
    database.moved = {"/files/v07292ev5.zip": "https://elsewhere.example/v07292ev5.zip"}
    with pytest.raises(RecordingError, match="elsewhere.example/.*: not on a host of NHTSA's: not followed"):
        fetched(database)


def test_a_package_larger_than_allowed_is_not_taken(database, monkeypatch):
    monkeypatch.setattr(limits, "PACKAGE", limits.Range(0, 1000, "bytes", ""))
    with pytest.raises(RecordingError, match="more than the 1000 allowed"):
        fetched(database)


def test_what_is_made_of_it_is_called_after_it():
    assert name_of("nhtsa:10146") == "nhtsa-10146" and name_of("a/crash.csv") == "crash"
    assert np.isfinite(limits.TEST_NUMBER.highest)
