"""Plots and tables of a scorecard: times in UTC, counts of tracks, no exponents."""

import re
from dataclasses import replace

import numpy as np
import pytest

from multiradar.evaluation.card.figures import figures_of
from multiradar.evaluation.card.plots import card_plots
from multiradar.evaluation.card.tables import aircraft_table, card_tables, notes_of, preset_table
from multiradar.evaluation.presets import PRESETS
from multiradar.evaluation.scorecard import Scorecard, evaluate
from multiradar.evaluation.settings import EvaluationSettings
from multiradar.report.cells import table_texts
from multiradar.report.content import Plot
from support.scenarios.skies import reference_of, straight, tracks_of

EIGHT = 1533110400.0
FLIGHT = straight(np.arange(0.0, 300.0, 4.0).tolist(), 0.0, 0.0, 200.0, 0.0)


def _card(start_s: float, error_m: float = 30.0) -> Scorecard:
    flown = [(start_s + row[0], *row[1:]) for row in FLIGHT]
    simulated = [(row[0], row[1], row[2] + error_m, *row[3:]) for row in flown]
    # One update is off by far more than the others.
    late = simulated[50]
    simulated[50] = (late[0], late[1], late[2] + 20.0 * error_m, *late[3:])
    tracks = replace(tracks_of({7: simulated}), initiated=5)
    return evaluate(
        tracks, reference_of({"one": flown}), EvaluationSettings(gate_m=1e5), tuple(PRESETS)
    )


def _plot(card: Scorecard, name: str) -> Plot:
    return next(one for one in card_plots(card) if one.name == name)


@pytest.mark.parametrize("name", ["errors-over-time", "numbers", "ospa", "nees-position"])
def test_time_is_utc_where_the_date_is_known(name: str) -> None:
    dated, of_day = _plot(_card(EIGHT), name), _plot(_card(28_800.0), name)
    assert (dated.x_label, dated.x_scale) == ("UTC, 2018-08-01", "time")
    assert (of_day.x_label, of_day.x_scale) == ("time of day", "time")
    first = min(float(np.nanmin(series.x)) for series in dated.series)
    assert EIGHT <= first <= EIGHT + 10.0


def test_the_largest_error_is_given_its_time() -> None:
    assert _plot(_card(EIGHT), "worst").title.endswith(", aircraft one, 2018-08-01 08:03:20 UTC")
    assert _plot(_card(28_800.0), "worst").title.endswith(", aircraft one, 08:03:20")


def test_without_an_established_track_no_error_is_the_largest() -> None:
    """An aircraft in sight for a minute: every update is of track initiation."""
    flown = FLIGHT[:14]
    card = evaluate(
        tracks_of({7: flown}), reference_of({"one": flown}), EvaluationSettings(), tuple(PRESETS)
    )
    assert len(card.errors.time_s)
    assert "worst" not in [one.name for one in card_plots(card)]


def test_tracks_are_counted_by_state() -> None:
    compared = figures_of(_card(EIGHT))["compared"]
    assert isinstance(compared, dict)
    assert (compared["tracks"], compared["tracks_confirmed"]) == (1, 1)
    assert compared["tracks_initiated"] == 5


def test_no_table_has_an_exponent_for_large_or_small_errors() -> None:
    for error_m in (1e-7, 12_345.0):
        card = _card(EIGHT, error_m)
        figures = figures_of(card) | {"reference": {"kind": "truth"}}
        tables = [preset_table(figures), *card_tables(figures), aircraft_table(figures)]
        cells = [text for table in tables for row in table_texts(table) for text in row]
        assert len(cells) > 100
        assert [text for text in cells if re.search(r"\d[eE][-+]?\d", text)] == []
        assert not any(re.search(r"\d[eE][-+]?\d", note) for note in notes_of(card, figures))
