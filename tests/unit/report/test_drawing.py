"""Plots keep their colours, limits and extremes, and do not change matplotlib's state."""

import re
import zlib
from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from xml.etree import ElementTree

import matplotlib as mpl
import numpy as np
import pytest

from multiradar.report import drawing
from multiradar.report.colours import (
    PALETTE,
    Colour,
    assign_colours,
    is_wide,
)
from multiradar.report.content import Plot, Series, Style, Table
from multiradar.report.drawing import draw_group, plain_state
from multiradar.report.markdown import markdown_table
from multiradar.report.plot_files import plot_svg, write_plots
from multiradar.report.thinning import POINTS_MAX, thin
from multiradar.report.time_axis import step_of, tick_text
from multiradar.research.studies.result import StudyOptions
from support.fakes.fake_study import ENTRY

#: Columns of a thinned line.
COLUMNS = 300
X = np.linspace(0.0, 10.0, 20)
#: Seconds between two ticks of an axis.
STEPS_S = (
    1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 60.0, 120.0, 300.0, 600.0, 900.0, 1800.0, 3600.0, 7200.0,
    10_800.0, 21_600.0, 43_200.0, 86_400.0, 172_800.0,
)  # fmt: skip


def _plot(*keys: str, style: Style = "line", scale: float = 1.0) -> Plot:
    series = tuple(Series(key, X, scale * X, style) for key in keys)
    return Plot("t", "x", "y", series, group="g")


def _colours(*plots: Plot) -> Mapping[str, Colour]:
    return assign_colours(plots)


def test_filters_have_their_own_colours_in_every_study() -> None:
    one, other = _colours(_plot("two-stage", "ci")), _colours(_plot("exact", "ci", "two-stage"))
    assert one["two-stage"] is other["two-stage"]
    assert one["ci"] is other["ci"]
    assert len({colour.mark for colour in other.values()}) == 3


def test_more_keys_than_colours_repeat_colours() -> None:
    keys = [f"track {number}" for number in range(20)]
    colours = _colours(_plot(*keys))
    assert set(colours) == set(keys)
    assert {colour.mark for colour in colours.values()} == {colour.mark for colour in PALETTE}


def test_colour_placeholders_are_unique() -> None:
    assert len({colour.mark for colour in PALETTE}) == len(PALETTE)


def test_the_reference_filter_is_wide_only_beside_others() -> None:
    compared, alone = _plot("joint", "two-stage"), _plot("joint")
    assert [is_wide(series, compared) for series in compared.series] == [True, False]
    assert not is_wide(alone.series[0], alone)


def test_axes_of_one_label_share_limits_in_a_group_unless_given() -> None:
    plots = [_plot("a"), _plot("a", scale=5.0)]
    first, second = (figure.axes[0] for figure in draw_group(plots, _colours(*plots)))
    assert first.get_ylim() == second.get_ylim()
    assert first.get_ylim()[1] > 50.0
    other = Plot("t", "x", "another unit", plots[1].series, group="g")
    apart = [figure.axes[0] for figure in draw_group([plots[0], other], _colours(*plots))]
    assert apart[0].get_xlim() == apart[1].get_xlim()
    assert apart[0].get_ylim()[1] < 20.0 < apart[1].get_ylim()[1]
    fixed = Plot("t", "x", "y", plots[0].series, y_limits=(0.0, 2.0))
    assert draw_group([fixed], _colours(fixed))[0].axes[0].get_ylim() == (0.0, 2.0)


def test_a_logarithmic_axis_leaves_out_non_positive_values() -> None:
    y = np.array([0.0, -1.0, np.nan, 1e-3, 1e3])
    plot = Plot("t", "x", "y", (Series("a", np.arange(5.0), y),), y_scale="log")
    axes = draw_group([plot], _colours(plot))[0].axes[0]
    low, high = axes.get_ylim()
    assert 1e-5 < low < 1e-3
    assert 1e3 < high < 1e5
    # Powers of ten are labelled, intermediate ticks are not.
    assert {mark.tick1line.get_markersize() for mark in axes.yaxis.get_minor_ticks()} <= {0.0}


def test_drawing_leaves_no_trace_in_matplotlib() -> None:
    before = dict(mpl.rcParams)
    with plain_state():
        assert mpl.rcParams["svg.fonttype"] == "none"
        draw_group([_plot("a")], _colours(_plot("a")))
    assert dict(mpl.rcParams) == before


def test_a_long_line_keeps_its_ends_and_extremes() -> None:
    x = np.arange(100_000.0)
    y = np.sin(x / 1000.0)
    y[54_321], y[77_777] = 40.0, -40.0
    thinned = thin(Series("a", x, y), COLUMNS)
    assert len(thinned.x) <= 5 * COLUMNS
    assert (thinned.x[0], thinned.x[-1]) == (x[0], x[-1])
    assert (thinned.y.max(), thinned.y.min()) == (40.0, -40.0)


def test_a_long_band_keeps_both_edges_and_a_gap_stays_a_gap() -> None:
    x = np.arange(50_000.0)
    low, high = -np.ones(len(x)), np.ones(len(x))
    low[123], high[45_678] = -9.0, 9.0
    low[30_000:31_000] = np.nan
    thinned = thin(Series("a", x, low, "band", high), COLUMNS)
    assert thinned.y2 is not None
    assert (np.nanmin(thinned.y), thinned.y2.max()) == (-9.0, 9.0)
    gap = thinned.x[np.isnan(thinned.y)]
    assert 30_000.0 <= gap.min() <= 30_000.0 + len(x) / COLUMNS
    assert 31_000.0 - len(x) / COLUMNS <= gap.max() < 31_000.0


def test_a_line_that_turns_back_is_unchanged_and_a_cloud_is_bounded() -> None:
    angle = np.linspace(0.0, 60.0, 9000)
    track = Series("a", np.cos(angle), np.sin(angle), "track")
    assert thin(track, COLUMNS) is track
    cloud = thin(Series("a", angle, angle, "points"), COLUMNS)
    assert POINTS_MAX / 2 <= len(cloud.x) <= POINTS_MAX
    nothing = Series("a", X[:0], X[:0], "points")
    assert len(thin(nothing, COLUMNS).x) == 0


def test_a_picture_for_documents_is_self_contained() -> None:
    result = ENTRY.run(StudyOptions(), lambda _done, _total: None)
    text = plot_svg(result.plots, result.plots[0])
    root = ElementTree.fromstring(text)
    assert root.tag == "{http://www.w3.org/2000/svg}svg"
    assert "var(" not in text
    assert "#0a0b" not in text
    words = {element.text for element in root.iter("{http://www.w3.org/2000/svg}text")}
    assert {result.plots[0].title, "time, s", "two-stage", "expected"} <= words
    assert text == plot_svg(result.plots, result.plots[0])


def _dashes(text: str) -> list[str]:
    """Dash patterns of the lines of an SVG file, each once; empty for a solid one."""
    lines = re.findall(r'<path d="[^"]*"[^>]*style="fill: none; ([^"]*)"', text)
    found = [re.search(r"stroke-dasharray: ([\d., ]+)", style) for style in lines]
    return [one[1] if one else "" for one in found]


def test_lines_in_print_differ_without_colours() -> None:
    series = tuple(Series(name, X, X * rank) for rank, name in enumerate("abc", start=1))
    again = Series("", X, X * 4.0, key="a")
    plot = Plot("t", "x", "y", (*series, again, Series("true", X, X * 5.0, "dashed")))
    colours, for_print = (plot_svg([plot], plot, for_print=one) for one in (False, True))
    # Five lines, and four of the legend.
    assert len(set(_dashes(colours))) == 2
    assert len(set(_dashes(for_print))) == 4
    assert _dashes(for_print).count("") == _dashes(colours).count("") - 4


@pytest.mark.slow
def test_each_plot_becomes_an_svg_and_a_pdf_with_reproducible_bytes(tmp_path: Path) -> None:
    result = ENTRY.run(StudyOptions(), lambda _done, _total: None)
    folders = [tmp_path / name for name in ("a", "b")]
    for folder in folders:
        folder.mkdir()
        names = write_plots(result.plots, folder)
        assert len(set(names)) == len(result.plots)
        assert sorted(names) == names
        expected = [f"{name}.{kind}" for name in names for kind in ("pdf", "svg")]
        assert sorted(path.name for path in folder.iterdir()) == expected
    for path in folders[0].iterdir():
        assert path.read_bytes() == (folders[1] / path.name).read_bytes(), path.name
    pdf = (folders[0] / f"{names[0]}.pdf").read_bytes()
    streams = re.findall(rb"stream\r?\n(.*?)\r?\nendstream", pdf, re.DOTALL)
    drawn = b"".join(zlib.decompress(one) for one in streams if one.startswith(b"x"))
    colours = {one.decode() for one in re.findall(rb"([\d.]+ [\d.]+ [\d.]+) RG", drawn)}
    # In place of the placeholders, #0a0b…, the colours on white.
    assert not [one for one in colours if one.startswith("0.0392")]
    assert len(colours) > 3


@pytest.mark.slow
def test_a_file_is_named_after_its_title_without_values(tmp_path: Path) -> None:
    titles = ("Figure 3: a = 1 m/s², v = 3 °/s", "NEES, v = 3", "Errors from t* = 5 s", "A: b, c")
    plots = [Plot(title, "x", "y", (Series("s", X, X),)) for title in titles]
    names = ["001-figure-3", "002-nees", "003-errors-from", "004-a-b-c"]
    assert write_plots(plots, tmp_path) == names


def test_a_table_for_documents_keeps_its_columns() -> None:
    text = markdown_table(Table("t", ("a|b", "n"), (("x|y\nz", 1.0), (None, 0.25)), "Caption."))
    assert text.splitlines() == [
        r"| a\|b | n |",
        "|---|---:|",
        r"| x\|y z | 1 |",
        "| – | 0.25 |",
        "",
        "Caption.",
    ]


def test_ticks_keep_their_digits() -> None:
    plot = Plot("t", "x", "y", (Series("a", X + 1.0, 10.0 ** (-X / 2.5)),), y_scale="log")
    result = ENTRY.run(StudyOptions(), lambda _done, _total: None)
    result.plots[:] = [plot]
    texts = re.findall(r"<text[^>]*>([^<]*)</text>", plot_svg(result.plots, plot))
    assert {"0.0001", "0.001", "0.01", "0.1", "1"} <= set(texts)


def test_maps_of_a_group_are_square_and_of_one_scale(
    caplog: pytest.LogCaptureFixture,
) -> None:
    tracks = (Series("a", X, 3.0 * X, "track"), Series("a", 9.0 * X, X, "track"))
    maps = [Plot("t", "x", "y", (one,), equal_axes=True, group="g") for one in tracks]
    figures = draw_group(maps, _colours(*maps))
    for axes in (figure.axes[0] for figure in figures):
        (west, east), (south, north) = axes.get_xlim(), axes.get_ylim()
        assert west < 0.0
        assert east > 90.0
        assert east - west == pytest.approx(north - south)
        assert south < 0.0
        assert north > 30.0
    assert not caplog.records


def test_points_beyond_an_axis_are_marked_and_counted() -> None:
    cloud = Series(
        "updates", np.arange(6.0), np.array([1.0, 9.0, 2.0, 30.0, np.nan, 3.0]), "points"
    )
    line = Series("RMS", np.arange(6.0), np.array([1.0, 1.0, -7.0, 1.0, 1.0, 1.0]))
    band = Series("band", np.arange(6.0), np.full(6, -50.0), "band", np.full(6, 50.0))
    plot = Plot("t", "x", "y", (cloud, line, band), y_limits=(0.0, 5.0))
    axes = draw_group([plot], _colours(plot))[0].axes[0]
    assert sorted(text.get_text() for text in axes.texts) == [
        "1 off scale",
        "2 off scale",
    ]
    ends = [line for line in axes.lines if line.get_marker() in {"^", "v"}]
    marked = {str(line.get_marker()): line for line in ends}
    assert sorted(marked) == ["^", "v"]
    above = axes.transAxes.transform(np.column_stack(marked["^"].get_data()))
    at = axes.transData.inverted().transform(above)
    assert at[:, 0] == pytest.approx([1.0, 3.0], abs=0.07)
    assert at[:, 1] == pytest.approx([5.0, 5.0])
    assert marked["v"].get_color() != marked["^"].get_color()


def test_points_beside_an_axis_and_in_a_corner_are_counted_once() -> None:
    series = Series("a", np.array([-1.0, 1.0, 4.0, 4.0]), np.array([1.0, 1.0, 1.0, 9.0]), "rings")
    plot = Plot("t", "x", "y", (series,), x_limits=(0.0, 2.0), y_limits=(0.0, 2.0))
    axes = draw_group([plot], _colours(plot))[0].axes[0]
    assert [text.get_text() for text in axes.texts] == ["1 off scale"] * 3
    markers = [str(line.get_marker()) for line in axes.lines if line.get_marker() != "o"]
    assert sorted(markers) == ["<", ">", "^"]


def test_values_without_a_logarithm_are_beyond_the_low_end() -> None:
    y = np.array([0.0, -1.0, np.nan, 1e-3, 1e3])
    plot = Plot("t", "x", "y", (Series("a", np.arange(5.0), y),), y_scale="log")
    axes = draw_group([plot], _colours(plot))[0].axes[0]
    assert [text.get_text() for text in axes.texts] == ["2 off scale"]


def test_a_plot_that_shows_all_its_points_has_no_note() -> None:
    plots = [_plot("a"), _plot("a", scale=5.0, style="points")]
    fixed = Plot("t", "x", "y", plots[0].series, x_limits=(0.0, 10.0), y_limits=(0.0, 10.0))
    for figure in draw_group([*plots, fixed], _colours(*plots)):
        assert not figure.axes[0].texts


@pytest.mark.parametrize(
    ("start_s", "length_s", "marks"),
    [
        (1533110400.0, 1800.0, ["08:00", "08:05", "08:10", "08:15", "08:20", "08:25", "08:30"]),
        (86_390.0, 20.0, ["23:59:50", "23:59:55", "00:00:00", "00:00:05", "00:00:10"]),
        (1533081600.0, 345_600.0, ["08-01", "08-02", "08-03", "08-04", "08-05"]),
    ],
)
def test_an_axis_of_data_times_shows_the_time_of_day_or_the_day(
    start_s: float, length_s: float, marks: list[str]
) -> None:
    times = np.linspace(start_s, start_s + length_s, 50)
    plot = Plot("t", "UTC", "y", (Series("a", times, times - start_s),), x_scale="time")
    axes = draw_group([plot], _colours(plot))[0].axes[0]
    shown = [
        axes.xaxis.get_major_formatter()(value)
        for value in axes.get_xticks()
        if start_s <= value <= start_s + length_s
    ]
    assert shown == marks


@pytest.mark.parametrize(
    ("span_s", "step_s"),
    [
        (0.5, 1.0),
        (7.1, 2.0),
        (1e6, 172_800.0),
        # A step is used up to a span of seven steps.
        *((7.0 * step_s, step_s) for step_s in STEPS_S),
    ],
)
def test_an_axis_of_data_times_has_seven_marks_at_most(span_s: float, step_s: float) -> None:
    assert step_of(span_s) == step_s


@pytest.mark.parametrize(
    ("step_s", "dated", "undated"),
    [
        (30.0, "12:00:00", "12:00:00"),
        (60.0, "12:00", "12:00"),
        (21_600.0, "12:00", "12:00"),
        (43_200.0, "08-01 12:00", "day 2 12:00"),
        (86_400.0, "08-01", "day 2"),
        (172_800.0, "08-01", "day 2"),
    ],
)
def test_a_tick_has_a_date_where_an_axis_is_of_several_days(
    step_s: float, dated: str, undated: str
) -> None:
    noon_s = datetime(2018, 8, 1, 12, tzinfo=UTC).timestamp()
    assert tick_text(noon_s, step_s) == dated
    assert tick_text(1.5 * 86_400.0, step_s) == undated
    # Before the year 1 there are no dates.
    assert tick_text(-1e12, 86_400.0) == "day -11574075"


@pytest.mark.parametrize(
    ("style", "equal_axes", "expected"),
    [("line", False, True), ("line", True, False), ("points", False, False)],
)
def test_only_lines_of_a_plot_that_is_no_map_run_to_its_edges(
    style: Style, equal_axes: bool, expected: bool
) -> None:
    plot = replace(_plot("a", style=style), equal_axes=equal_axes)
    assert drawing._runs_in_time(plot) is expected
