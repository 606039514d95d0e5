"""The tables of a dump against each other."""

import numpy as np
import polars as pl
import pytest

from multiradar.diagnosis.dumps.tables import check_tables

FOOT_M = 0.3048
LATITUDE, LONGITUDE, HEIGHT = (
    pl.col(name) for name in ("latitude_deg", "longitude_deg", "height_m")
)
FILES = ("plots.txt", "plots_ads.txt", "tracks.txt")


def table(late_s: float, **columns: pl.Expr) -> pl.DataFrame:
    """Return rows of five aircraft, each of its own speed and height, every 10 s."""
    time_s = np.arange(0.0, 600.0, 10.0) + late_s
    rows = [
        pl.DataFrame(
            {
                "time_s": time_s,
                "track_number": [number] * len(time_s),
                "latitude_deg": 46.0 + 0.001 * number * time_s / 10.0,
                "longitude_deg": 7.0 + 0.01 * time_s / 10.0,
                "height_m": 2000.0 + 1000.0 * number + 5.0 * time_s / 10.0,
            }
        )
        for number in range(1, 6)
    ]
    return pl.concat(rows).sort("time_s").with_columns(**columns)


def sentences(*tables: pl.DataFrame) -> list[str]:
    """Return the diagnoses of tables under the names of a dump's files."""
    named = dict(zip(FILES, tables, strict=False))
    return [one.sentence for one in check_tables(named)]


def test_tables_that_agree_are_right() -> None:
    low = table(4.0, height_m=HEIGHT * 0.97)
    assert sentences(table(0.0), table(2.0), low) == []


@pytest.mark.parametrize("wrong", range(3))
def test_exchanged_columns_are_those_of_the_table_that_differs(wrong: int) -> None:
    tables = [table(2.0 * number) for number in range(3)]
    tables[wrong] = table(1.0, latitude_deg=LONGITUDE, longitude_deg=LATITUDE)
    (found,) = sentences(*tables)
    assert found.startswith(f"{FILES[wrong]}: its latitudes and longitudes are probably swapped:")


def test_of_two_tables_either_may_have_exchanged_columns() -> None:
    (found,) = sentences(table(0.0), table(1.0, latitude_deg=LONGITUDE, longitude_deg=LATITUDE))
    assert "plots.txt" in found
    assert "(or those in plots_ads.txt are)" in found


@pytest.mark.parametrize("wrong", range(3))
@pytest.mark.parametrize(
    ("factor", "unit"),
    [
        (1.0 / FOOT_M, "feet:"),
        (0.01 / FOOT_M, "flight levels:"),
        (0.01, "hundreds of metres:"),
        (0.001, "kilometres:"),
        (FOOT_M, "metres converted once more from feet:"),
    ],
)
def test_the_unit_of_heights_is_named(wrong: int, factor: float, unit: str) -> None:
    tables = [table(2.0 * number) for number in range(3)]
    tables[wrong] = table(1.0, height_m=HEIGHT * factor)
    (found,) = sentences(*tables)
    assert found.startswith(f"{FILES[wrong]}: its heights are probably in {unit}")


def test_of_two_tables_the_larger_heights_are_feet() -> None:
    (found,) = sentences(table(0.0), table(1.0, height_m=HEIGHT / FOOT_M))
    assert found.startswith("plots_ads.txt: its heights are probably in feet:")


def test_tables_without_common_aircraft_or_heights_are_not_compared() -> None:
    other = table(1.0, track_number=pl.lit(77, pl.Int64), height_m=HEIGHT / FOOT_M)
    assert sentences(table(0.0), other) == []
    unknown = table(1.0, height_m=pl.lit(None, pl.Float64))
    assert sentences(table(0.0), unknown) == []
