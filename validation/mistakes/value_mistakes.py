"""Mistakes in values for check_mistakes.py: rarer units, counts, folded or halved azimuths.

The rows are made as those of mistakes_catalogue.py; `VALUE_MISTAKES` goes after its `CATALOGUE`.
"""

from collections.abc import Callable
from pathlib import Path

import polars as pl

from validation.mistakes.mistake import (
    AZIMUTH,
    CONVERT,
    RADAR,
    RANGE,
    SECONDS_PER_DAY,
    SENSORS,
    TIME,
    TRACK,
    Mistake,
    Sample,
    dump,
    plots,
    settings,
)

_MILE_M, _NM = 1609.344, 1852.0
_RADARS = SENSORS[:-1]
#: 1970-01-01 in days of a spreadsheet.
_SPREADSHEET_DAYS = 25_569.0
_NOTHING = pl.lit(None)

Rows = list[list[str]]


def _edited(column: str, change: Callable[[float], str]) -> Callable[[Rows], Rows]:
    """Return a function that changes the numbers of a column of a dump."""

    def made(rows: Rows) -> Rows:
        index = rows[0].index(column)
        for row in rows[1:]:
            try:
                row[index] = change(float(row[index]))
            except (ValueError, IndexError):
                continue
        return rows

    return made


def _with_an_empty_field(rows: Rows) -> Rows:
    return [rows[0], *([*row, ""] for row in rows[1:])]


# Seconds of the day in the digits of a clock.
def _as_digits(seconds: float) -> str:
    minutes, second = divmod(seconds, 60.0)
    return f"{minutes // 60:02.0f}{minutes % 60:02.0f}{second:06.3f}"


def _with_ranges_as_azimuths(rows: Rows) -> Rows:
    first, later = rows[0].index("range"), rows[0].index("azimuth")
    for row in rows[1:]:
        try:
            row[first], row[later] = row[later], f"{float(row[first]) / 1e3:.4f}"
        except (ValueError, IndexError):
            continue
    return rows


def _with_profile(text: str) -> Callable[[Sample, Path], None]:
    def made(sample: Sample, folder: Path) -> None:
        dump()(sample, folder)
        (folder / "profile.toml").write_text(text, encoding="utf-8")

    return made


VALUE_MISTAKES: tuple[Mistake, ...] = (
    Mistake(
        "ranges in statute miles",
        plots(RADAR, range_m=RANGE / _MILE_M),
        message=("26-10: its ranges are probably in statute miles",),
    ),
    Mistake(
        "ranges of all radars in statute miles",
        plots(range_m=RANGE / _MILE_M),
        message=("26-10: its ranges are probably in statute miles, like those of all radars",),
        sensors=_RADARS,
    ),
    Mistake(
        "ranges in units of 1/16 NM",
        plots(RADAR, range_m=RANGE / _NM * 16.0),
        message=("26-10: its ranges are probably in units of 1/16 NM",),
    ),
    Mistake(
        "azimuths in counts of 16 384",
        plots(RADAR, azimuth_deg=AZIMUTH / 360.0 * 16_384.0),
        message=("26-10: its azimuths are probably in counts of 16 384 per revolution",),
    ),
    Mistake(
        "azimuth counts modulo 360",
        plots(RADAR, azimuth_deg=(AZIMUTH / 360.0 * 4096.0).floor() % 360.0),
        message=(RADAR, "no single error of a unit, its site or its clock explains this"),
    ),
    Mistake(
        "azimuths halved",
        plots(RADAR, azimuth_deg=AZIMUTH / 2.0),
        message=("26-10: its azimuths are probably half the true ones",),
    ),
    Mistake(
        "azimuths modulo 180°",
        plots(RADAR, azimuth_deg=AZIMUTH % 180.0),
        message=("26-10: its azimuths are probably reduced modulo 180°",),
    ),
    Mistake(
        "azimuths in degrees and minutes",
        plots(RADAR, azimuth_deg=AZIMUTH.floor() + 0.6 * (AZIMUTH % 1.0)),
        message=("26-10: its azimuths are probably in degrees and minutes",),
    ),
    Mistake(
        "NaN for heights",
        plots(RADAR, height_m=pl.lit(float("nan"))),
        message=(RADAR, "height_m is not a number (NaN); leave it empty (null)"),
    ),
    Mistake(
        "one sensor_id for all radars",
        plots(sensor_id=pl.lit(RADAR)),
        message=("26-10: its plots are probably also those of 35-10, 41-1, 41-10",),
    ),
    Mistake(
        "times of one radar in days of a spreadsheet",
        plots(RADAR, time_s=TIME / SECONDS_PER_DAY + _SPREADSHEET_DAYS),
        message=("26-10: its times are probably in days since 1899-12-30",),
    ),
    Mistake(
        "code 7000 in all plots, without any other identity or height",
        plots(
            mode_3a=pl.lit("7000"),
            track_number=_NOTHING.cast(pl.Int64),
            mode_s_address=_NOTHING.cast(pl.String),
            height_m=_NOTHING.cast(pl.Float64),
        ),
        status=0,
        message=("26-10: mode_3a is probably a placeholder: the value is 7000",),
        sensors=_RADARS,
    ),
    Mistake(
        "latitudes of ADS-B of the row before",
        plots("adsb", latitude_deg=pl.col("latitude_deg").shift(1).over("sensor_id")),
        TRACK,
        message=("adsb: its latitude_deg probably belongs to other rows",),
        sensors=("adsb",),
    ),
    Mistake(
        "a position_sigma_m of 5 km",
        settings("adsb", position_sigma_m=5000.0),
        TRACK,
        message=("adsb: position_sigma_m is probably too large",),
        sensors=("adsb",),
    ),
    Mistake(
        "a position_sigma_m of 0.2 m",
        settings("adsb", position_sigma_m=0.2),
        TRACK,
        message=("adsb: position_sigma_m is probably too small",),
        sensors=("adsb",),
    ),
    Mistake(
        "convert: ranges in statute miles",
        dump(plots=_edited("range", lambda metres: f"{metres / _MILE_M:.6f}")),
        CONVERT,
        message=("26-10: its ranges are probably in statute miles",),
        sensors=_RADARS,
    ),
    Mistake(
        "convert: azimuth counts modulo 360",
        dump(plots=_edited("azimuth", lambda degrees: f"{int(degrees / 360 * 4096) % 360}")),
        CONVERT,
        message=("26-10: its ranges and azimuths do not fit the positions",),
        sensors=_RADARS,
    ),
    Mistake(
        "convert: times in hours",
        dump(plots=_edited("time", lambda seconds: f"{seconds / 3600.0:.9f}")),
        CONVERT,
        message=("the times of day of the other sensors are probably in hours",),
        sensors=("adsb",),
    ),
    Mistake(
        "convert: a separator at the end of each line",
        dump(plots=_with_an_empty_field),
        CONVERT,
        message=("a separator at the end of the line, which the header does not have",),
        sensors=(),
    ),
    Mistake(
        "convert: azimuths of half of the circle negative",
        dump(plots=_edited("azimuth", lambda degrees: f"{(degrees + 180.0) % 360.0 - 180.0:.4f}")),
        CONVERT,
        message=(
            "plots.txt: 48% of its",
            "azimuths between -180° and",
            "add 360° to negative azimuths",
        ),
        sensors=_RADARS,
    ),
    Mistake(
        "ADS-B positions displaced by 20 km",
        plots("adsb", latitude_deg=pl.col("latitude_deg") + 0.18),
        TRACK,
        message=("adsb: its positions are probably displaced by 19.9 km north",),
        sensors=("adsb",),
    ),
    Mistake(
        "convert: times of plots.txt as HHMMSS",
        dump(plots=_edited("time", _as_digits)),
        CONVERT,
        message=("26-10: its times are probably hours, minutes and seconds as one number",),
        sensors=_RADARS,
    ),
    Mistake(
        "convert: swapped columns of azimuths and ranges in km",
        dump(plots=_with_ranges_as_azimuths),
        CONVERT,
        message=("26-10: its range and azimuth columns are probably swapped: its ranges advance",),
        sensors=_RADARS,
    ),
    Mistake(
        "convert: a profile with azimuths in radians for degrees",
        _with_profile('[units]\nazimuth = "radian"\n'),
        (*CONVERT, "--profile", "profile.toml"),
        message=("was '13.8440' (times 57.2958 by [units] of the profile)", "correct the unit"),
        sensors=(),
    ),
    Mistake(
        "400 km added to the ranges",
        plots(RADAR, range_m=RANGE + 400e3),
        message=("26-10: its ranges probably contain a constant of up to 4",),
    ),
)
