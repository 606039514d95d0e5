"""One identity in the plots of all aircraft: the bounds from which it is named."""

import numpy as np
import polars as pl
import pytest

from multiradar.diagnosis.cross_sensor.identities import check_identities, check_one_code
from multiradar.diagnosis.plots import Plots, plots_of

PLOTS, CELLS = 20, 6
FL195_M = 5943.6


def plots(
    count: int = PLOTS,
    cells: int = CELLS,
    *,
    shared: int | None = None,
    code: str = "7000",
    height_m: float | None = FL195_M + 0.1,
    addressed: int = 0,
) -> pl.DataFrame:
    """Return reports within 12 s, in turn from as many cells; `shared` of them have the code."""
    number = np.arange(count)
    others = [f"{0o1001 + one:04o}" for one in range(count)]
    alike = count if shared is None else shared
    return pl.DataFrame({
        "time_s": 5000.0 + 0.1 * number,
        "range_m": np.full(count, np.nan),
        "azimuth_deg": np.full(count, np.nan),
        "latitude_deg": 46.0 + 0.5 * (number % cells),
        "longitude_deg": np.full(count, 7.0),
        "height_m": pl.Series([height_m] * count, dtype=pl.Float64),
        "track_number": pl.Series([None] * count, dtype=pl.Int64),
        "mode_s_address": pl.Series(
            [f"{0x4B1800 + one:06x}" if one < addressed else None for one in range(count)],
            dtype=pl.String,
        ),
        "mode_3a": [code] * alike + others[alike:],
    })  # fmt: skip


def by_code(frame: pl.DataFrame) -> str | None:
    found = check_one_code("adsb", frame, None)
    return None if found is None else found.severity


def by_key(frame: pl.DataFrame) -> str | None:
    # A code that identifies aircraft, instead of one of conspicuity.
    named: Plots = plots_of(frame.with_columns(pl.col("mode_3a").replace("7000", "4321")))
    found = check_identities("adsb", named, None)
    return None if found is None else found.severity


@pytest.mark.parametrize("named", [by_code, by_key])
@pytest.mark.parametrize(
    ("frame", "wrong"),
    [
        (plots(), True),
        (plots(19), False),
        (plots(20, shared=19), True),
        (plots(20, shared=18), False),
        (plots(cells=5), False),
    ],
    ids=["all-bounds", "plots", "share", "below-share", "cells"],
)
def test_twenty_plots_in_six_cells_of_which_95_percent_share_it(
    frame: pl.DataFrame, named: object, *, wrong: bool
) -> None:
    assert callable(named)
    assert named(frame) == ("error" if wrong else None)


@pytest.mark.parametrize(
    ("frame", "severity"),
    [
        # All low traffic may fly under visual flight rules.
        (plots(height_m=FL195_M), None),
        (plots(height_m=FL195_M, code="2000"), "error"),
        (plots(height_m=None), "warning"),
        (plots(height_m=None, code="0000"), "error"),
        (plots(code="1000"), None),
        (plots(addressed=10), "error"),
        (plots(addressed=11), "warning"),
    ],
    ids=["low", "unassigned", "no-heights", "zeros", "mode-s", "half-addressed", "addressed"],
)
def test_a_code_of_conspicuity_by_height_and_addresses(
    frame: pl.DataFrame, severity: str | None
) -> None:
    assert by_code(frame) == severity
