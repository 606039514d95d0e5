"""Runs and scorecards as figures of matplotlib."""

import io
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

import multiradar as mr
from multiradar.errors import ArgumentError
from multiradar.report.colours import ALL


def _drawn(figure: Figure) -> str:
    stream = io.StringIO()
    figure.savefig(stream, format="svg")
    return stream.getvalue()


def test_a_run_is_a_map_and_its_biases(tracked: mr.Run) -> None:
    figure = tracked.plot()
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles[0] == "Map of tracks"
    biases = tracked.biases.select("sensor_id", "parameter").unique()
    assert len(titles) == 1 + len(biases)
    # The band is the estimate with ± 2 sigma.
    last = tracked.biases.filter(parameter="range_offset_m")[-1]
    axes = next(one for one in figure.axes if one.get_title(loc="left").endswith("range offset"))
    line = next(one for one in axes.lines if one.get_label() == "estimate")
    assert np.asarray(line.get_ydata())[-1] == pytest.approx(last["estimate"][0])
    band = np.asarray(axes.collections[0].get_paths()[0].vertices)
    own = band[band[:, 0] == band[:, 0].max(), 1]
    assert own.max() - own.min() == pytest.approx(4.0 * last["sigma"][0])


def test_colours_are_those_on_white_and_no_placeholders(tracked: mr.Run) -> None:
    text = _drawn(tracked.plot()).lower()
    assert [one.mark for one in ALL if to_hex(one.mark) in text] == []
    assert ALL[4].light in text


def test_a_notebook_shows_a_picture_without_pyplot(tracked: mr.Run) -> None:
    # Only the use of pyplot lets a notebook show plain figures; `_repr_png_` shows any object.
    shown = tracked.plot("map")._repr_png_()  # type: ignore[attr-defined]  # for notebooks
    assert shown.startswith(b"\x89PNG")


def test_a_scorecard_draws_what_is_named(made: Path, tracked: mr.Run) -> None:
    card = mr.evaluate(tracked, truth=made / "scene")
    shown = card.plot().axes
    assert len(shown) == 4
    # Legible over points.
    legends = [legend for one in shown if (legend := one.get_legend()) is not None]
    assert legends
    assert all((one.get_frame().get_alpha() or 0.0) > 0.5 for one in legends)
    [axes] = card.plot("ospa").axes
    assert axes.get_title(loc="left").startswith("OSPA")
    with pytest.raises(ArgumentError, match=r"unknown plot 'osp' \(did you mean 'ospa'\?\)"):
        card.plot("osp")
