"""Which part of a recording is replayed: start offset, duration, from, until, channels, exclude."""

import numpy as np
import pytest
from helpers_replay import some_recording

from crash_replay.selection import SelectionError, Window, samples_within, select_channels

TIME_NS = (np.arange(41) - 10) * 1_000_000  # -10 to 30 ms


@pytest.mark.parametrize(
    ("window", "expected"),
    [
        (Window(), (0, 41)),
        (Window(start_offset=0.010), (10, 41)),
        (Window(start_offset=0.010, duration=0.005), (10, 16)),
        (Window(begin=0.0, until=0.005), (10, 16)),
        (Window(start_offset=0.012, begin=0.0), (12, 41)),
        (Window(until=1.0), (0, 41)),
    ],
)
def test_both_ends_of_the_window_are_played(window, expected):
    assert samples_within(window, TIME_NS) == expected


def test_a_time_that_no_float_is_exactly_still_names_its_sample():
    time_ns = np.arange(1000) * 100_000
    assert samples_within(Window(begin=0.0348, until=0.0348), time_ns) == (348, 349)


def test_an_empty_window_says_what_there_is():
    with pytest.raises(SelectionError, match=r"from 0.05 s, .*-0.01 to 0.03 s|no sample to play with from 0.05 s"):
        samples_within(Window(begin=0.05), TIME_NS)


def test_channels_are_chosen_by_name_and_pattern():
    recording = some_recording()
    chosen = select_channels(recording, ["rib_*", "barrier_fx"], ["rib_vy"])
    assert chosen.test.channel_names == ("rib_ay", "barrier_fx")
    np.testing.assert_array_equal(chosen.values[:, 1], recording.column("barrier_fx"))


def test_channels_are_chosen_by_regular_expressions_too():
    recording = some_recording()
    by_both = select_channels(recording, ["barrier_fx"], regex="^rib_.y$", exclude_regex="v")
    assert by_both.test.channel_names == ("rib_ay", "barrier_fx")
    assert select_channels(recording, regex="head|neck").test.channel_names == ("neck_mz", "head_wx")


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"regex": "rib_("}, r"parameter regex must be a regular expression, got 'rib_\('"),
        ({"exclude_regex": "door"}, "parameter exclude_regex: 'door' is found in no channel's name: there are rib_ay"),
        ({"exclude_regex": "_"}, "no channel is left of what is chosen"),
    ],
)
def test_a_regular_expression_that_leaves_nothing_is_an_error(given, said):
    with pytest.raises(SelectionError, match=said):
        select_channels(some_recording(), **given)


def test_all_channels_leave_the_recording_as_it_is():
    recording = some_recording()
    assert select_channels(recording) is recording


@pytest.mark.parametrize(
    ("wanted", "excluded", "said"),
    [
        (["rib_ax"], [], "did you mean rib_ay"),
        ([], ["door*"], "parameter exclude: the recording has no channel door"),
        (["rib_ay"], ["rib_ay"], "no channel is left"),
    ],
)
def test_what_fits_no_channel_is_an_error(wanted, excluded, said):
    with pytest.raises(SelectionError, match=said):
        select_channels(some_recording(), wanted, excluded)
