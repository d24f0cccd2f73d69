"""What is missing, on the screen: bars that grow, errors, shades, revisions, auto-correlation; and the validation."""

from dataclasses import replace
from pathlib import Path

import helpers_viewer as crash_data
import numpy as np
import pytest
from helpers_findings import ADDED, candidate, ranking, revision, story
from helpers_viewer import NAMES, column, feed, recorder, rows, series, settle, values_of, with_damping
from numpy.testing import assert_allclose
from rerun.blueprint.api import Container, View
from rerun.chunk import RrdReader

from crash_estimator.core.estimate import ParameterStatus
from crash_estimator.core.validation import autocorrelation, validate
from crash_estimator.model_file import load_model
from crash_estimator.viewer import layout, validation
from crash_estimator.viewer.blocks import Block, ForceBlock, ParameterBlock, ResidualBlock, join
from crash_estimator.viewer.cast import Cast, member
from crash_estimator.viewer.colors import CONFOUNDED, LIMIT_COLORS, TOLD, WEAK
from crash_estimator.viewer.judged import Jury, describe, estimates_of, judge
from crash_estimator.viewer.ranking import LEFT, color_of, ranking_drawing, revision_color
from crash_estimator.viewer.revisions import LAGS, whiteness_drawing

G = 9.80665

pytestmark = pytest.mark.usefixtures("strict")


@pytest.fixture(scope="module")
def crash() -> crash_data.Crash:
    return crash_data.simulate(n=900)


@pytest.fixture(scope="module")
def structure():
    """The springs and names of the stream."""
    ready = load_model("frontal_engine_cab")
    assert tuple(element.name for element in ready.elements) == crash_data.ELEMENTS
    return ready


@pytest.fixture(scope="module")
def streams(crash) -> dict[str, list[Block]]:
    streams = crash_data.two_streams(crash)
    for name in NAMES:
        streams[name] = [with_damping(b) if isinstance(b, ParameterBlock) else b for b in streams[name]]
    streams[NAMES[0]] = [with_weights(b) if isinstance(b, ParameterBlock) else b for b in streams[NAMES[0]]]
    return streams


def with_weights(block: ParameterBlock) -> ParameterBlock:
    """Of a bank of two models, and when the first has jumped."""
    n = len(block.time_ns)
    weight = np.linspace(0.0, 1.0, n)
    besides = np.column_stack([weight, 1.0 - weight, np.full(n, 0.01)])
    return block._replace(
        name=(*block.name, "model0.weight", "model1.weight", "model0.jump"),
        unit=(*block.unit, "1", "1", "s"),
        value=np.hstack([block.value, besides]),
        std=np.hstack([block.std, np.full((n, 3), np.nan)]),
        status=np.hstack([block.status, np.full((n, 3), ParameterStatus.METHOD, np.uint8)]),
    )


@pytest.fixture(scope="module")
def rrd(crash, streams, structure, tmp_path_factory) -> Path:
    """Both estimators and a diagnosis."""
    path = tmp_path_factory.mktemp("missing") / "crash.rrd"
    known = {structure.name: structure}
    target = recorder(path, say=pytest.fail, structure_of=lambda estimator, revision, model: known.get(model))
    findings = story(crash)
    target.put(lambda: findings[0])  # before the first estimator is known
    feed(target, crash, streams)
    for finding in findings[1:]:
        target.put(lambda finding=finding: finding)
    settle(target)
    assert target.complete
    target.close()
    return path


def views(part: Container | View) -> list[View]:
    return [part] if isinstance(part, View) else [view for sub in part.contents for view in views(sub)]


def names_of_tabs(cast: Cast) -> list[str]:
    return [tab.name for tab in layout.tabs(cast)]


@pytest.fixture(scope="module")
def cast(crash, streams) -> Cast:
    cast = Cast(crash_data.test_block(crash), (crash.time_ns[0] * 1e-9, crash.time_ns[-1] * 1e-9))
    for name in NAMES:
        cast = cast.with_member(member(*streams[name][:3]))
    return cast


def whole(cast: Cast, crash: crash_data.Crash) -> Cast:
    block = revision(crash, "two_mass", 0.1, True)
    outputs = tuple(zip(block.name, block.unit))
    return replace(cast, rankings=(0, 1), outputs=outputs, revisions_whole=True, judged=NAMES)


class TestTabs:
    def test_tabs_come_when_there_is_something_for_them(self, cast, crash):
        plain = replace(cast, members=cast.members[1:])
        assert names_of_tabs(plain)[0] == "Overview"
        assert {"Missing effect", "Method", "Validation"}.isdisjoint(names_of_tabs(plain))
        assert names_of_tabs(cast)[-1] == "Method"
        every = names_of_tabs(whole(cast, crash))
        assert every[0] == "Missing effect" and every[-1] == "Validation"
        assert names_of_tabs(Cast(cast.test, cast.span, rankings=(0,))) == ["Missing effect"], "without estimators"
        layout.blueprint(Cast(cast.test, cast.span))  # nobody yet

    def test_every_view_has_data(self, rrd, cast, crash):
        found, cast = rows(rrd), whole(cast, crash)
        for view in (view for tab in layout.tabs(cast) for view in views(tab)):
            origin = "/" + view.origin.strip("/")
            assert any(e == origin or e.startswith(origin + "/") for e in found), f"nothing in {view.name!r}: {origin}"

    def test_units_stand_in_the_titles(self, cast, crash):
        titles = [view.name for view in views(layout.tabs(whole(cast, crash))[0])]
        assert {"cab: acceleration, g", "barrier: force, kN"} <= set(titles)
        assert "engine: what is left, with the noise's 99 % band, g" in titles


class TestRanking:
    def test_bars_grow_with_the_evidence_and_the_samples(self, rrd):
        times, texts = column(rrd, "/ranking/0/texts", "Points2D:labels")
        assert times.tolist() == [20_000_000, 40_000_000, 60_000_000, 79_900_000]
        assert "up to 40.0 ms: effect missing" in texts[1] and "all samples: effect missing" in texts[3]
        assert f"{ADDED}: 1800 ± 200 N" in texts[3]
        lengths = [_bar(drawing_of(e)) for e in (2.0, 20.0, 60.0)]
        assert lengths == sorted(lengths)
        _, revised = column(rrd, "/ranking/1/texts", "Points2D:labels")
        assert "all samples: adequate" in revised[0]

    def test_colours_say_what_a_candidate_is_worth(self):
        assert color_of(candidate("a on b", 5.9)) == WEAK
        assert color_of(candidate("a on b", 30.0)) == TOLD
        assert color_of(candidate("a on b", 30.0, ("c on d",))) == CONFOUNDED
        assert {"told apart", "a rival fits as well"} <= set(drawing_of(30.0).texts)

    def test_the_error_of_each_revision_and_the_noise_floor(self, rrd):
        times, texts = column(rrd, "/error/texts", "Points2D:labels")
        assert "0 as given" in texts[0] and not any("+" in text for text in texts[0]), "nothing found yet"
        assert f"1 + {ADDED}" in texts[1], "with the best so far"
        assert {"0 as given", f"1 + {ADDED}", "RMS residual of this test, g; noise floor 1.02"} <= set(texts[-1])
        assert any(text.endswith(", white") for text in texts[-1])


def drawing_of(evidence: float):
    return ranking_drawing(ranking(0.05, evidence))


def _bar(drawing) -> float:
    """Length of the first bar in the units of its axis."""
    colored = next(k for k, color in enumerate(drawing.strip_colors) if color in (TOLD, CONFOUNDED, WEAK))
    return drawing.strips[colored][1][0] - LEFT


class TestRevisions:
    def test_measured_before_and_after_on_the_same_samples(self, rrd, crash):
        after = crash.time_ns >= 0
        signals = (("measured", crash.measured), ("model/00", 0.7 * crash.truth), ("model/01", crash.truth))
        for entity, signal in signals:
            times, values = series(rrd, f"/revision/cab/whole/{entity}", "Scalars:scalars")
            assert times.tolist() == crash.time_ns[after].tolist(), "once, though it is said twice"
            assert_allclose(values[:, 0], signal[after, 0] / G, rtol=1e-6)
        times, _ = series(rrd, "/revision/cab/so_far/model/00", "Scalars:scalars")
        assert len(times) == 600, "stretch by stretch while samples came"

    def test_the_band_of_the_noise_is_behind_what_is_left(self, rrd):
        _, variances = column(rrd, "/left/barrier/whole/band", "Measurements:variances")
        assert_allclose(np.sqrt(variances[0]), 2.576 * 5.0, rtol=1e-3)  # kN

    def test_windows_of_misfit_are_shaded_by_state(self, rrd):
        times, values = column(rrd, "/left/engine/whole/misfit_unloading", "Measurements:values")
        assert times.tolist() == [29_999_999, 30_000_000, 60_000_000]
        assert np.isnan(values[0][0]) and values[1][0] == values[2][0] == 0.0, "a gap, then the shade"
        assert not any("/cab/whole/misfit" in entity for entity in rows(rrd)), "the cab fits"
        so_far, _ = column(rrd, "/left/engine/so_far/misfit_loading", "Measurements:values")
        assert so_far.tolist() == [9_999_999, 10_000_000, 20_000_000, 20_000_000, 30_000_000], "without a gap"

    def test_whiteness_is_the_auto_correlation_with_its_limits(self, crash):
        given, better = revision(crash, "m", 0.3, True), revision(crash, "m + a on b", 0.0, True)
        drawing = whiteness_drawing([given, better], 0)
        for k, block in enumerate((given, better)):
            stems = [s for s, c in zip(drawing.strips, drawing.strip_colors) if c == revision_color(k)]
            assert len(stems) == LAGS
            found = autocorrelation(block.residual[:, 0], LAGS).values[1:]
            heights = np.array([-stem[1][1] + stem[0][1] for stem in stems])
            assert_allclose(heights, np.maximum(found, -0.5) * 0.6, atol=1e-9)  # 1.5 is 0.9 high

    def test_names_of_revisions(self, crash):
        assert revision(crash, "two-mass", 0.1, True).label == "as given"
        assert revision(crash, "m + a on b-c + d on e", 0.1, True).changes == ["+ a on b-c", "+ d on e"]
        assert revision(crash, "m - a on b", 0.1, True).label == "- a on b"


class TestValidation:
    def test_blocks_give_the_validation_of_the_estimates(self, streams, structure):
        blocks = streams[NAMES[1]]
        kinds = {type(block): block for block in join(blocks)}
        parts = kinds[ParameterBlock], kinds[ResidualBlock], kinds[ForceBlock]
        expected = validate(structure, describe(*parts), estimates_of(*parts))
        judged = judge(structure, blocks)
        assert_allclose(judged.validation.covariance, expected.covariance)
        assert {e.equation for e in judged.validation.equations} == {"cab", "engine", "barrier"}
        assert judged.simulated is not None and len(judged.comparisons) == 5
        jury = Jury(lambda estimator, revision, model: structure)
        for block in (b for stream in streams.values() for b in stream):
            jury.hear(block)
        assert set(jury.verdicts(NAMES)) == set(NAMES)
        assert judge(load_model("frontal_single"), blocks) is None, "of another model"

    def test_tables_and_limits(self, cast, streams, structure):
        judged = judge(structure, streams[NAMES[0]])  # with what the method knows besides
        text = validation.tables(cast, NAMES[0], judged)
        assert "|  | cab, g | engine, g | barrier, kN |" in text and "**covariance of the error**" in text
        assert "auto-correlation: lags within 95% limits" in text and "ISO/TS 18571" in text
        cross = judged.validation.equations[0].cross["cab_barrier.crush"]
        drawing = validation.correlation_drawing(cast, {NAMES[0]: cross})
        for level, color in zip((0.90, 0.95, 0.99), LIMIT_COLORS):
            lines = [s for s, c in zip(drawing.strips, drawing.strip_colors) if c == color]
            drawn = sorted({round((-strip[0][1] - 0.45) / 0.45, 9) for strip in lines})
            limit = round(cross.limit(level), 9)
            assert drawn == ([-limit, limit] if limit <= 1 else [])

    def test_inputs_are_those_of_the_bodys_elements(self, cast):
        assert cast.inputs_of("engine") == (
            "engine_barrier.crush", "engine_barrier.rate", "cab_engine.crush", "cab_engine.rate",
        )  # fmt: skip


def test_weights_of_a_bank_share_a_plot_and_are_no_parameters(rrd, cast):
    assert ("model0.weight", "1") in cast.member(NAMES[0]).besides
    assert not any("weight" in name for name, _ in cast.parameters)
    _, first = series(rrd, f"/method/{NAMES[0]}/weight/model0.weight", "Scalars:scalars")
    _, second = series(rrd, f"/method/{NAMES[0]}/weight/model1.weight", "Scalars:scalars")
    assert_allclose(first + second, 1.0)
    assert not any("jump" in entity for entity in rows(rrd)), "a moment is an event"


def test_styles_are_readable(rrd):
    """Revision 0 is red and the one with the effect green, in every plot."""
    names = {}
    for chunk in RrdReader(rrd).stream():
        if chunk.is_static and str(chunk.entity_path).startswith("/revision/engine/whole/model/"):
            batch = chunk.to_record_batch()
            names |= {str(chunk.entity_path)[-2:]: row for row in values_of(batch, "SeriesLines:names")}
    assert names["00"].tolist() == ["0 as given"] and names["01"].tolist() == [f"1 + {ADDED}"]


def test_a_diagnosis_before_or_without_estimators_is_shown(crash, streams, tmp_path):
    target = recorder(tmp_path / "alone.rrd", say=pytest.fail)
    target.expected = ()
    findings = story(crash)
    target.put(lambda: crash_data.test_block(crash))
    for finding in findings:
        target.put(lambda finding=finding: finding)
    target.close()
    assert rows(tmp_path / "alone.rrd")["/ranking/0/lines"] == 4
