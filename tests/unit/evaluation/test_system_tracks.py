"""Updates of another processor's track numbers, divided into flights."""

import polars as pl
import pytest

from multiradar.evaluation.system_tracks import SILENCE_S, named_by_flight

FIRST, SECOND = "3c0001", "4b0002"


def updates(*rows: tuple[float, int | None, str | None, float, str]) -> pl.DataFrame:
    columns = ("time_s", "track_number", "mode_s_address", "latitude_deg", "state")
    frame = pl.DataFrame(rows, schema=columns, orient="row")
    return frame.with_columns(
        pl.col("track_number").cast(pl.Int64),
        pl.col("mode_s_address").cast(pl.String),
        longitude_deg=pl.lit(8.0),
    )


def names(*rows: tuple[float, int | None, str | None, float, str]) -> list[str | None]:
    return named_by_flight(updates(*rows))["track_number"].to_list()


def test_a_number_used_again_after_its_end_is_another_flight() -> None:
    found = names(
        (0.0, 14, FIRST, 47.0, "confirmed"),
        (1.0, 15, SECOND, 48.0, "confirmed"),
        (4.0, 14, FIRST, 47.0, "ended"),
        (5.0, 14, FIRST, 47.0, "ended"),
        (8.0, 14, None, 45.0, "tentative"),
        (12.0, 14, SECOND, 45.0, "confirmed"),
        (16.0, 14, SECOND, 45.0, "ended"),
        (30.0, 14, FIRST, 46.0, "confirmed"),
    )
    assert found == ["14", "15", "14", "14", "14/2", "14/2", "14/2", "14/3"]


def test_a_number_that_changes_its_address_for_good_is_another_flight() -> None:
    steady = [(4.0 * k, 14, FIRST if k < 3 else SECOND, 47.0, "confirmed") for k in range(6)]
    assert names(*steady) == ["14"] * 3 + ["14/2"] * 3
    # One wrong address, and reports without one.
    garbled = [
        (4.0 * k, 14, address, 47.0, "confirmed")
        for k, address in enumerate((FIRST, None, SECOND, FIRST, None, FIRST))
    ]
    assert names(*garbled) == ["14"] * 6


@pytest.mark.parametrize(
    ("latitude_deg", "silence_s", "flights"),
    [(50.0, SILENCE_S + 4.0, 2), (47.1, SILENCE_S + 4.0, 1), (50.0, SILENCE_S - 4.0, 1)],
)
def test_a_number_that_returns_elsewhere_after_a_silence_is_another_flight(
    latitude_deg: float, silence_s: float, flights: int
) -> None:
    found = names(
        (0.0, 14, None, 47.0, "confirmed"),
        (silence_s, 14, None, latitude_deg, "confirmed"),
    )
    assert len(set(found)) == flights


def test_updates_without_a_number_stay_without_one() -> None:
    assert names((0.0, None, FIRST, 47.0, "ended"), (4.0, None, FIRST, 47.0, "confirmed")) == [
        None,
        None,
    ]
