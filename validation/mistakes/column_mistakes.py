"""Mistakes in columns of measurements for check_mistakes.py: constant values, times, heights.

The rows are made as those of mistakes_catalogue.py; `COLUMN_MISTAKES` goes after its `CATALOGUE`.
"""

from collections.abc import Callable
from pathlib import Path

import polars as pl

from validation.mistakes.mistake import (
    RADAR,
    SECONDS_PER_DAY,
    SENSORS,
    TRACK,
    Mistake,
    Sample,
    all_times,
    plots,
    reflections,
    settings,
    tables_of,
    text_of,
    write,
)

_TIME, _AZIMUTH = pl.col("time_s"), pl.col("azimuth_deg")
#: The recording starts at 2018-08-01 08:00:00 UTC and has 30 minutes.
_MIDDLE_S = 1_533_110_400.0 + 900.0


def _days(*sensors: str, days: float) -> Callable[[Sample, Path], None]:
    """Return a function that shifts the second part of plots by days."""
    later = pl.when(_TIME > _MIDDLE_S).then(days * SECONDS_PER_DAY).otherwise(0.0)
    return plots(*sensors, time_s=_TIME + later)


def _sensor_twice(sample: Sample, folder: Path) -> None:
    tables = tables_of(sample)
    write(folder, sample.measurements, text_of([*tables, tables[0]]))


def _two_under_one(sample: Sample, folder: Path) -> None:
    name = pl.col("sensor_id").replace({"35-10": RADAR})
    write(folder, sample.measurements.with_columns(name), sample.sensors)


def _degrees_minutes(one: dict[str, float], name: str) -> float:
    """Return degrees and minutes of a coordinate as one number."""
    degrees = int(one[name])
    return round(degrees + 0.6 * (one[name] - degrees), 6)


_RADARS = SENSORS[:-1]
_RANGE, _HEIGHT = pl.col("range_m"), pl.col("height_m")

COLUMN_MISTAKES: tuple[Mistake, ...] = (
    Mistake(
        "ranges 0.3 % too long",
        plots(RADAR, range_m=_RANGE * 1.003),
        message=("26-10: its ranges are probably 0.3",),
    ),
    Mistake(
        "ground ranges computed on a flat Earth",
        plots(RADAR, range_m=(_RANGE**2 - _HEIGHT**2).clip(1.0).sqrt()),
        message=(RADAR, "ground ranges"),
    ),
    Mistake(
        "a clock that jumps by 1.5 s",
        plots(RADAR, time_s=_TIME + 1.5 * (_TIME > _MIDDLE_S)),
        message=("26-10: its clock probably jumped by +1.", "2018-08-01 08:15"),
    ),
    Mistake(
        "the times of plots are those of the start of the scan",
        plots(RADAR, time_s=(_TIME / 4.9).floor() * 4.9),
        message=("26-10: all plots of a scan have the same time",),
    ),
    Mistake(
        "all sigmas 40 times too small",
        settings(
            *_RADARS,
            range_sigma_m=lambda one: one["range_sigma_m"] / 40.0,
            azimuth_sigma_deg=lambda one: one["azimuth_sigma_deg"] / 40.0,
        ),
        message=("26-10: range_sigma_m and azimuth_sigma_deg are probably too small", "scatter"),
        sensors=_RADARS,
    ),
    Mistake(
        "Radar in the column kind",
        plots(RADAR, kind=pl.lit("Radar")),
        TRACK,
        message=("26-10: kind is probably wrong", "write radar in lower case"),
    ),
    Mistake(
        "one radar without the first half",
        lambda sample, folder: write(
            folder,
            sample.measurements.filter((_TIME > _MIDDLE_S) | (pl.col("sensor_id") != RADAR)),
            sample.sensors,
        ),
        status=0,
        message=("26-10: its measurements start at 2018-08-01 08:15",),
    ),
    Mistake(
        "10 minutes missing from all sensors",
        lambda sample, folder: write(
            folder,
            sample.measurements.filter(~_TIME.is_between(_MIDDLE_S - 300.0, _MIDDLE_S + 300.0)),
            sample.sensors,
        ),
        status=0,
        message=("no sensor has measurements from 2018-08-01 08:",),
        sensors=("",),
    ),
    Mistake(
        "azimuth 10° in all plots",
        plots(RADAR, azimuth_deg=pl.lit(10.0)),
        message=("26-10: its azimuth_deg is probably a placeholder",),
    ),
    Mistake(
        "range 0 in all plots",
        plots(RADAR, range_m=pl.lit(0.0)),
        message=("26-10: its range_m is probably a placeholder",),
    ),
    Mistake(
        "azimuths in tenths of a degree",
        plots(RADAR, azimuth_deg=10.0 * _AZIMUTH),
        message=("26-10: its azimuths are probably in tenths of a degree",),
    ),
    Mistake(
        "ranges of the way there and back",
        plots(RADAR, range_m=2.0 * pl.col("range_m")),
        message=("26-10: its ranges are probably twice the true distances",),
    ),
    Mistake(
        "half the ranges",
        plots(RADAR, range_m=0.5 * pl.col("range_m")),
        message=("26-10: its ranges are probably half the true distances",),
    ),
    Mistake(
        "heights above the radar",
        plots(RADAR, height_m=pl.col("height_m") - 1677.0),
        message=("26-10: its heights probably have an offset", "heights above its site?"),
    ),
    Mistake(
        "heights with another pressure, 300 m off",
        plots(RADAR, height_m=pl.col("height_m") + 300.0),
        message=("26-10: its heights probably have an offset", "(QNH)"),
    ),
    Mistake(
        "unknown heights as -9999",
        plots(RADAR, height_m=pl.lit(-9999.0)),
        message=("26-10: its height_m is probably a placeholder", "-9999 in all plots"),
    ),
    Mistake(
        "Mode 3/A codes in decimal",
        plots(mode_3a=pl.col("mode_3a").str.to_integer(base=8, strict=False).cast(pl.String)),
        message=("26-10: its Mode 3/A codes (mode_3a) are probably decimal numbers",),
        sensors=SENSORS,
    ),
    Mistake(
        "a clock off by 1 s",
        plots(RADAR, time_s=_TIME + 1.0),
        message=("26-10: its clock is probably 1.0 s ahead",),
    ),
    Mistake(
        "ADS-B in GPS time (18 s ahead)",
        plots("adsb", time_s=_TIME + 18.0),
        TRACK,
        message=("adsb: its clock is probably 18.", "(GPS time instead of UTC?)"),
        sensors=("adsb",),
    ),
    Mistake(
        "an ADS-B clock off by 5 s",
        plots("adsb", time_s=_TIME + 5.0),
        TRACK,
        message=("adsb: its clock is probably 5.0 s ahead",),
        sensors=("adsb",),
    ),
    Mistake(
        "times in milliseconds",
        plots(time_s=1e3 * _TIME),
        message=("the times are probably in milliseconds",),
        sensors=SENSORS,
    ),
    Mistake(
        "times in minutes",
        plots(time_s=_MIDDLE_S + (_TIME - _MIDDLE_S) / 60.0),
        message=("26-10: its times are probably in minutes",),
        sensors=SENSORS,
    ),
    Mistake(
        "times in whole seconds",
        plots(time_s=_TIME.floor()),
        message=("26-10: its times probably lack fractions of a second", "multiples of 1 s"),
        sensors=SENSORS,
    ),
    Mistake(
        "times in half seconds",
        plots(time_s=0.5 * (2.0 * _TIME).floor()),
        status=0,
        message=("26-10: its times probably lack fractions of a second", "multiples of 0.5 s"),
        sensors=SENSORS,
    ),
    Mistake(
        "a date that leaps by a day",
        _days(days=1.0),
        message=("the times probably jump by a day",),
    ),
    Mistake(
        "a date that falls back by a day",
        _days(days=-1.0),
        message=("have a gap of 23.5 h", "wrong dates"),
    ),
    Mistake(
        "two recordings of a radar, three days apart",
        _days(RADAR, days=3.0),
        message=("26-10: its times probably jump by 3 days",),
    ),
    Mistake(
        "two sensors with one id",
        _sensor_twice,
        message=("two sensors are named 26-10",),
    ),
    Mistake(
        "site in degrees and minutes (46.2548 for 46.4247)",
        settings(
            RADAR,
            latitude_deg=lambda one: _degrees_minutes(one, "latitude_deg"),
            longitude_deg=lambda one: _degrees_minutes(one, "longitude_deg"),
        ),
        message=("26-10: its site is probably 18.7 km north",),
    ),
    Mistake(
        "a range sigma three times too small",
        settings(RADAR, range_sigma_m=13.3),
        status=0,
        message=("26-10: range_sigma_m is probably too small", "2.8 times as large"),
    ),
    Mistake(
        "an azimuth sigma three times too large",
        settings("35-10", azimuth_sigma_deg=0.15),
        status=0,
        message=("35-10: azimuth_sigma_deg is probably too large", "0.35 times as large"),
        sensors=("35-10",),
    ),
    Mistake(
        "a clock off by 0.3 s",
        plots(RADAR, time_s=_TIME + 0.3),
        status=0,
        message=("26-10: its clock is probably 0.31 s ahead",),
    ),
    Mistake(
        "azimuths in whole degrees",
        plots(RADAR, azimuth_deg=_AZIMUTH.round() % 360.0),
        message=("26-10: its azimuth_deg is probably rounded", "multiples of 1°"),
    ),
    Mistake(
        "azimuths from -180° to 180°",
        plots(RADAR, azimuth_deg=_AZIMUTH - pl.when(_AZIMUTH > 180.0).then(360.0).otherwise(0.0)),
        message=("26-10: its azimuths probably range from -180° to 180°",),
    ),
    Mistake(
        "azimuths of all radars off by 2.5°",
        plots(azimuth_deg=(_AZIMUTH + 2.5) % 360.0),
        message=("26-10: its azimuths are probably off by +2.3°, like those of all radars",),
        sensors=SENSORS,
    ),
    Mistake(
        "azimuths of all radars off by 4°, plots without identity",
        plots(anonymous=True, azimuth_deg=(_AZIMUTH + 4.0) % 360.0),
        message=("26-10: its azimuths are probably off by about +4°, like those of all radars",),
        sensors=SENSORS,
    ),
    Mistake(
        "ADS-B declared as multilateration",
        settings("adsb", kind="mlat"),
        TRACK,
        message=("adsb: kind is probably wrong", "declares mlat"),
        sensors=("adsb",),
    ),
    Mistake(
        "ADS-B displaced by 3 km",
        plots("adsb", latitude_deg=pl.col("latitude_deg") + 0.027),
        TRACK,
        message=("adsb: its positions are probably displaced by 3.0", "km north"),
        sensors=("adsb",),
    ),
    Mistake(
        "ADS-B positions in hundredths of a degree",
        plots(
            "adsb",
            latitude_deg=pl.col("latitude_deg").round(2),
            longitude_deg=pl.col("longitude_deg").round(2),
        ),
        TRACK,
        message=("adsb: its latitude_deg is probably rounded", "multiples of 0.01°"),
        sensors=("adsb",),
    ),
    Mistake(
        "a range offset of 5 km",
        plots(RADAR, range_m=pl.col("range_m") + 5000.0),
        status=0,
        message=(
            "26-10: the estimated range offset is +51",
            "check the range calibration of the radar",
        ),
    ),
    Mistake(
        "azimuths in revolutions",
        plots(RADAR, azimuth_deg=_AZIMUTH / 360.0),
        message=("26-10: its azimuths are probably in revolutions",),
    ),
    Mistake(
        "heights of all radars in units of 25 ft",
        plots(height_m=pl.col("height_m") / 7.62),
        message=("26-10: its heights are probably in units of 25 ft",),
        sensors=SENSORS,
    ),
    Mistake(
        "missing heights written as 0",
        plots(RADAR, height_m=pl.lit(0.0)),
        message=("26-10: its height_m is probably a placeholder: the value is 0 in all plots",),
    ),
    Mistake(
        "one address in all plots of a radar",
        plots(RADAR, mode_s_address=pl.lit("3C6444")),
        message=("26-10: mode_s_address is probably the same for all its aircraft",),
    ),
    Mistake(
        "two radars under one identifier",
        _two_under_one,
        message=(
            "26-10: its plots are probably from two radars",
            "35-10: no measurements in the recording",
        ),
        sensors=(RADAR, "35-10"),
    ),
    Mistake(
        "align: ranges in kilometres",
        plots(range_m=pl.col("range_m") / 1e3),
        ("align", "measurements.parquet", "--sensors", "sensors.toml", "--kinds", "radar"),
        message=("26-10: its ranges are probably in kilometres",),
        sensors=SENSORS,
    ),
    Mistake(
        "azimuths 1 % too small",
        plots(RADAR, azimuth_deg=_AZIMUTH * 0.99),
        message=("26-10: its azimuths are probably 1.0% too small",),
    ),
    Mistake(
        "361 azimuth counts for 360",
        plots(RADAR, azimuth_deg=_AZIMUTH * (360.0 / 361.0)),
        message=("26-10: its azimuths are probably 0.3% too small",),
    ),
    *(
        Mistake(
            f"times that run at {factor:g} times their rate",
            all_times(factor),
            message=(f"the times probably advance {factor:g} s per second: all 4 radars",),
            sensors=(),
        )
        for factor in (2.0, 0.5)
    ),
    Mistake(
        "times of all sensors in milliseconds, without a date",
        all_times(1e3, dated=False),
        message=("the times are probably in milliseconds: all 4 radars",),
        sensors=(),
    ),
    Mistake(
        "30 % reflections",
        reflections(0.3),
        status=0,
        message=("26-10: its plots probably contain reflections (multipath replies)",),
    ),
    Mistake(
        "the track numbers of one radar are its own",
        plots(RADAR, track_number=pl.col("track_number") + 7),
        message=("26-10: its track numbers (track_number) are not those of",),
    ),
    Mistake(
        "each radar numbers its own tracks from 1",
        plots(track_number=pl.col("track_number").rank("dense").over("sensor_id").cast(pl.Int64)),
        message=("its track numbers (track_number) are not those of",),
        sensors=SENSORS,
    ),
    Mistake(
        "heights in other rows",
        plots(RADAR, height_m=pl.col("height_m").shuffle(1)),
        message=("26-10: its heights or the identities of its aircraft probably belong",),
    ),
)
