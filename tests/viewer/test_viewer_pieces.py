"""The pieces that the viewer's drawings are made of: axes, figures, blocks, limits, names."""

import math

import numpy as np
import pytest
import rerun.blueprint as rrb
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from crash_estimator.viewer import cast as cast_module
from crash_estimator.viewer import colors, layout
from crash_estimator.viewer.axes import axis_for, round_up, text
from crash_estimator.viewer.blocks import EventBlock, ForceBlock, ParameterBlock, ResidualBlock, join
from crash_estimator.viewer.cast import Cast
from crash_estimator.viewer.colors import ESTIMATOR_COLORS
from crash_estimator.viewer.frames import FRAMES, frame_ends
from crash_estimator.viewer.plausible import PARAMETER, PREDICTION, Limits
from crash_estimator.viewer.readable import plots, time_range, value_range
from crash_estimator.viewer.schematic import schematic
from crash_estimator.viewer.shapes import force_colors, force_scale
from crash_estimator.viewer.states import States
from crash_estimator.viewer.units import with_std


def test_blocks_are_joined_by_estimator_kind_and_run(streams):
    blocks = [*streams["mrls"][:6], *streams["ckf"][:3], streams["mrls"][6]._replace(run=1)]
    joined = join(blocks)
    assert [(type(b), b.estimator, b.run, len(b.time_ns)) for b in joined] == [
        (ParameterBlock, "mrls", 0, 100),
        (ResidualBlock, "mrls", 0, 100),
        (ForceBlock, "mrls", 0, 100),
        (ParameterBlock, "ckf", 0, 50),
        (ResidualBlock, "ckf", 0, 50),
        (ForceBlock, "ckf", 0, 50),
        (ParameterBlock, "mrls", 1, 50),
    ]
    assert_array_equal(joined[0].value, np.vstack([streams["mrls"][0].value, streams["mrls"][3].value]))


@pytest.mark.parametrize(
    ("low", "high", "ticks"),
    [
        (0, 745, [0, 200, 400, 600, 800]),
        (-160, 745, [-200, 0, 200, 400, 600, 800]),
        (-20, 745, [0, 200, 400, 600, 800]),  # noise about zero
        (0, 0.09, [0, 0.02, 0.04, 0.06, 0.08, 0.10]),
        (-3, 0, [-3, -2, -1, 0]),
    ],
)
def test_axes_have_round_ticks(low, high, ticks):
    assert_allclose(axis_for(low, high).ticks, ticks, atol=1e-12)


def test_ticks_have_the_digits_they_need():
    assert [text(v, 0.5) for v in (-0.5, 0.0, 1.0)] == ["−0.5", "0.0", "1.0"]
    assert text(-200.0, 200.0) == "−200"
    assert [round_up(v) for v in (1.0, 1.1, 3.0, 700.0)] == [1.0, 2.0, 5.0, 1000.0]


def test_the_figure_of_engine_and_cab():
    figure = schematic((("cab", "barrier"), ("engine", "barrier"), ("cab", "engine")))
    assert figure.columns == {"cab": 0, "engine": 1, "barrier": 2}
    assert figure.row_count == 2
    assert figure.rows[0] != figure.rows[1] == figure.rows[2]  # past the engine; through it
    assert figure.reference == "barrier"


def test_the_figure_of_the_dummy_has_no_spring_through_a_body():
    between = (("upper", "rib"), ("rib", "spine"), ("lower", "pelvis"), ("car", "pelvis"), ("pelvis", "spine"))
    figure = schematic(between)
    assert figure.row_count == 3
    spans = figure.heights
    for one in spans:
        for other in spans:
            if one < other and figure.columns[one] == figure.columns[other]:
                assert spans[one][1] < spans[other][0] or spans[other][1] < spans[one][0]


def test_a_ring_of_springs_still_has_a_figure():
    figure = schematic((("a", "b"), ("b", "c"), ("c", "a")))
    assert set(figure.columns) == {"a", "b", "c"}


def test_frames_are_few_for_a_long_block_and_one_for_a_short_one():
    time_ns = np.arange(10_000) * 100_000
    ends = frame_ends(time_ns, (0.0, 1.0))
    assert len(ends) == FRAMES
    assert ends[-1] == 9999
    assert_array_equal(frame_ends(time_ns[:3], (0.0, 1.0)), [2])


def test_an_estimate_that_runs_away_does_not_squash_the_plot(streams):
    parameters, residuals, forces = join(streams["mrls"])
    limits = Limits()
    wild = residuals.predicted.copy()
    wild[700, 0] = 1e9
    drawn = limits.predicted(residuals._replace(predicted=wild), 0)
    assert drawn.max() == PREDICTION * np.abs(residuals.measured[:, 0]).max()
    assert_array_equal(np.delete(drawn, 700), np.delete(residuals.predicted[:, 0], 700))
    wild = parameters.value.copy()
    wild[700, 1] = 1.01 * PARAMETER * wild[:, 1].max()
    drawn = limits.parameter(parameters._replace(value=wild), 1)
    assert np.flatnonzero(np.isnan(drawn)).tolist() == [700]
    assert limits.force(forces) > np.abs(forces.force).max()
    assert limits.force(forces) < 10 * np.abs(forces.force).max()


def test_a_stiffness_that_grows_when_contact_begins_is_drawn(streams):
    """Long before it nothing but the first guess was there; it must not count as what the stiffness usually is."""
    parameters = join(streams["mrls"])[0]
    value, std = np.full_like(parameters.value, 50.0), np.full_like(parameters.value, 50.0)
    value[1200:], std[1200:] = 400.0, 10.0
    drawn = Limits().parameter(parameters._replace(value=value, std=std), 0)
    assert_array_equal(drawn, value[:, 0])


def test_forces_of_light_bodies_are_in_newton(cast):
    light = cast.members[0]._replace(masses=(0.6, None, None))
    assert cast.shown("N").unit == "kN"
    assert Cast(cast.test, cast.span, (light,)).shown("N") == ("N", 1.0)


def test_an_estimator_keeps_its_colour_and_is_told_apart_by_its_model(cast):
    other = cast.members[1]._replace(name="kalman_frontal_single", model="frontal_single")
    three = cast.with_member(other)
    assert [three.color(name) for name in three.names] == list(ESTIMATOR_COLORS[:3])
    assert cast.label("mrls") == "mrls"
    assert three.label("mrls") == "mrls (frontal_engine_cab)"
    assert three.label("kalman_frontal_single") == "kalman_frontal_single"
    assert cast.with_member(cast.members[0]) == cast


def test_body_names_may_hold_hyphens():
    assert cast_module._ends("a-b-c", ("a", "a-b", "c")) == ("a-b", "c")
    with pytest.raises(ValueError, match="expected two of the bodies a, b"):
        cast_module._ends("a-x", ("a", "b"))


def test_only_the_first_event_of_a_stretch_is_listed():
    def event(time: float, kind: str = "rewound") -> EventBlock:
        return EventBlock("mrls", 0, 0, time, kind, "", "rewound")

    states = States(pen=None)
    stretch = [event(0.010 + 1e-4 * k) for k in range(200)]
    assert [states._repeats(e) for e in stretch] == [False] + [True] * 199
    assert not states._repeats(event(0.0302, "clamped"))
    assert not states._repeats(event(0.0402))


@pytest.mark.parametrize(
    ("value", "std", "written"),
    [(1543.2, 23.0, "1540 ± 20"), (0.12345, 0.0021, "0.123 ± 0.002"), (5.0, 0.0, "5"), (419.0, 1.2, "419 ± 1")],
)
def test_values_are_written_to_the_first_digit_of_their_sigma(value, std, written):
    assert with_std(value, std) == written


@given(st.floats(-1e6, 1e6), st.floats(1e-3, 1e6), st.floats(3.5, 30.0))
def test_a_value_axis_holds_its_lines_and_two_numbers(low, length, most):
    """Whatever is drawn, and however small the plot: never 0 alone."""
    high = low + length
    first, last = value_range(low, high, most)
    assert first <= low and high <= last
    steps = [10.0**k for k in range(-6, 9)]
    written = [numbers(first, last, step) for step in steps if (last - first) / step <= 1.1 * most]
    assert max(written) >= 2, (first, last)


def numbers(low: float, high: float, step: float) -> int:
    return math.floor(high / step + 1e-6) - math.ceil(low / step - 1e-6) + 1


@pytest.mark.parametrize(
    ("low", "high", "most", "expected"),
    [
        (-24.0, 37.0, 8.0, (-26.44, 39.44)),  # 10 g a step
        (-4.6, 5.0, 8.0, (-4.984, 10.5)),  # too many of 1 g: up to 10 g, not down as well
        (0.0, 450.0, 4.0, (-18.0, 1050.0)),
    ],
)
def test_a_value_axis_is_no_longer_than_it_must(low, high, most, expected):
    assert_allclose(value_range(low, high, most), expected)


@pytest.mark.parametrize(
    ("end", "width", "shown"),
    [
        (0.09, 420.0, 0.107),  # 10 ms have no room: up to 100 ms
        (0.09, 800.0, 0.09),
        (0.05, 420.0, 0.05),
        (0.15, 420.0, 0.15),  # 100 ms is there
        (0.5, 420.0, 0.5),
    ],
)
def test_a_time_axis_has_two_numbers_in_the_narrowest_plot(end, width, shown):
    assert_allclose(time_range((-0.05, end), width), (max(-0.05, -0.1 * end), shown))
    assert time_range((-0.05, -0.01), width) is None, "no impact: as Rerun shows it"


def test_every_time_plot_of_the_layout_is_linked_and_found(cast):
    every = rrb.Tabs(*layout.tabs(cast))
    found = list(plots(every))
    assert {str(plot.view.origin) for plot in found} >= {"/signal/cab", "/residual/barrier", "/innovation/engine"}
    assert all(100.0 < plot.width < 1600.0 and 60.0 < plot.height < 760.0 for plot in found)
    assert all(plot.view.properties["TimeAxis"].link is not None for plot in found)


def test_colours_can_be_told_from_a_dark_ground_and_from_a_white_one():
    told = [value for name, value in vars(colors).items() if name[0].isupper() and name.isupper() and name != "GRID"]
    every = [one for value in told for one in ([value] if isinstance(value[0], int) else value)]
    assert len(every) > 20
    for color in every:
        for ground in ((13, 13, 14), (255, 255, 255)):
            assert contrast(color, ground) >= 3.0, (color, ground)


def contrast(a: tuple[int, int, int], b: tuple[int, int, int]) -> float:
    """WCAG 2.1's ratio."""
    light, dark = sorted((luminance(a), luminance(b)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def luminance(color: tuple[int, int, int]) -> float:
    linear = [c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in (v / 255 for v in color)]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_forces_are_coloured_by_a_scale_that_fits_them():
    assert [force_scale(value) for value in (3.9e3, 23.1e3, 50e3, 51e3, 0.7)] == [4e3, 25e3, 50e3, 60e3, 0.8]
    none, some = force_colors(np.array([0.0, -4.1 / 25.0])).astype(int)
    assert np.abs(some - none).max() > 40, "a sixth of the largest force is no longer grey"
