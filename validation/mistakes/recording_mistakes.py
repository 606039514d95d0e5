"""Mistakes in a whole recording for check_mistakes.py: missing rows, codes, azimuths that jump.

The rows are made as those of mistakes_catalogue.py.
"""

from collections.abc import Callable
from pathlib import Path

import polars as pl

from validation.mistakes.mistake import (
    RADAR,
    SENSORS,
    TRACK,
    Mistake,
    Sample,
    alone,
    exchanged,
    plots,
    settings,
    write,
)

_TIME, _AZIMUTH = pl.col("time_s"), pl.col("azimuth_deg")
#: The recording starts at 2018-08-01 08:00:00 UTC.
_START_S = 1_533_110_400.0
_RADARS = SENSORS[:-1]
#: 0 in every third row of a sensor, else 1.
_TWO_OF_THREE = (pl.int_range(pl.len()).over("sensor_id") % 3 > 0).cast(pl.Float64)


def _thinned(every: int) -> Callable[[Sample, Path], None]:
    """Return a function that writes one in so many rows."""
    return lambda sample, folder: write(
        folder, sample.measurements.gather_every(every), sample.sensors
    )


def _without(from_s: float, to_s: float) -> Callable[[Sample, Path], None]:
    """Return a function that removes the rows of a time of the recording."""
    inside = (_START_S + from_s < _TIME) & (_START_S + to_s > _TIME)
    return lambda sample, folder: write(folder, sample.measurements.filter(~inside), sample.sensors)


def _turned(angle_deg: float, from_s: float) -> pl.Expr:
    """Return azimuths that are off by an angle from a time of the recording on."""
    turned = (_AZIMUTH + angle_deg) % 360.0
    return pl.when(_START_S + from_s <= _TIME).then(turned).otherwise(_AZIMUTH)


RECORDING_MISTAKES: tuple[Mistake, ...] = (
    Mistake(
        "one in ten rows of the recording",
        _thinned(10),
        message=(
            "26-10: its aircraft are detected only once in about",
            "rows are probably missing",
        ),
        sensors=_RADARS,
    ),
    Mistake(
        "a space behind sensor_id",
        plots(RADAR, sensor_id=pl.col("sensor_id") + " "),
        message=("26-10: the sensor_id of", "is '26-10 ', which differs", "by spaces only"),
    ),
    Mistake(
        "code 2000 in all plots",
        plots(*_RADARS, mode_3a=pl.lit("2000")),
        message=("26-10: mode_3a is probably a placeholder: the value is 2000",),
        sensors=_RADARS,
    ),
    Mistake(
        "code 1200 in all plots",
        plots(*_RADARS, mode_3a=pl.lit("1200")),
        message=("26-10: mode_3a is probably a placeholder: the value is 1200", "above FL195"),
        sensors=_RADARS,
    ),
    Mistake(
        "a range_max_m of 150 km for a radar of 300 km",
        settings(RADAR, range_max_m=150_000),
        message=("26-10: range_max_m is probably too small: it is 150000", "farther away, up to"),
    ),
    Mistake(
        "azimuths that jump by 3°",
        plots(RADAR, azimuth_deg=_turned(3.0, 240.0)),
        message=("26-10: its azimuths probably jumped by +3.0° at about 2018-08-01 08:0",),
    ),
    Mistake(
        "azimuths of all radars anticlockwise from east",
        plots(azimuth_deg=(450.0 - _AZIMUTH) % 360.0),
        message=("26-10: its azimuths are probably measured anticlockwise from east",),
        sensors=_RADARS,
    ),
    Mistake(
        "azimuths of the only radar anticlockwise from east",
        alone(plots(azimuth_deg=(450.0 - _AZIMUTH) % 360.0), RADAR),
        message=("26-10: its azimuths are probably measured anticlockwise",),
    ),
    Mistake(
        "every second row of the recording",
        _thinned(2),
        status=0,
        message=("26-10: its aircraft are detected only once in about 2 scans, like those of all",),
        sensors=_RADARS,
    ),
    Mistake(
        "two minutes missing in all sensors",
        _without(300.0, 420.0),
        command=TRACK,
        message=(
            "no sensor has measurements from 2018-08-01 08:05:00 UTC to 2018-08-01 08:07:00 UTC",
            "aircraft fly before and after it: a part of the recording is missing",
        ),
    ),
    Mistake(
        "an hour at a change of daylight saving time",
        plots(time_s=_TIME + pl.when(_START_S + 400.0 <= _TIME).then(3600.0).otherwise(0.0)),
        message=(
            "the times probably jump by 1 h, from 2018-08-01 08:06",
            "daylight saving time",
        ),
    ),
    Mistake(
        "height 5000 m in all plots",
        plots(RADAR, height_m=pl.lit(5000.0)),
        command=TRACK,
        message=("26-10: its height_m is probably a placeholder: the value is 5000 for all",),
    ),
    Mistake(
        "heights of all radars 300 m off against ADS-B",
        plots(height_m=pl.col("height_m") + 300.0),
        command=TRACK,
        message=(
            "adsb: its heights probably have an offset, or those of the radars have the opposite "
            "offset: they are 298 m below",
        ),
        sensors=("adsb",),
    ),
    Mistake(
        "ADS-B without heights",
        plots("adsb", height_m=pl.lit(None, pl.Float64)),
        command=TRACK,
        status=0,
        message=("adsb: its heights may be lost: none of its positions has one",),
        sensors=("adsb",),
    ),
    Mistake(
        "ADS-B displaced by 100 m",
        plots("adsb", latitude_deg=pl.col("latitude_deg") + 100.0 / 111_195.0),
        command=TRACK,
        message=(
            "adsb: its positions are probably displaced by 0.10 km north",
            "or the sites of all radars (26-10, 35-10, 41-1, 41-10) by the same distance in the "
            "opposite direction",
        ),
        sensors=("adsb",),
    ),
    Mistake(
        "ranges in steps of 0.1 NM",
        plots(RADAR, range_m=(pl.col("range_m") / 185.2).round() * 185.2),
        message=("26-10: its range_m is probably rounded: all values are multiples of 185.2 m",),
    ),
    Mistake(
        "ranges of at most 65 535 m",
        plots(RADAR, range_m=pl.min_horizontal("range_m", pl.lit(65_535.0))),
        message=("26-10: its ranges are probably limited to 65535 m",),
    ),
    Mistake(
        "a clock off by 60 s",
        plots(RADAR, time_s=_TIME + 60.0),
        message=("26-10: its clock is probably 5", "s ahead"),
    ),
    Mistake(
        "identities of the row before",
        plots(
            RADAR,
            track_number=pl.col("track_number").shift(1).over("sensor_id"),
            mode_3a=pl.col("mode_3a").shift(1).over("sensor_id"),
        ),
        message=("26-10: its track numbers (track_number)", "with those of the row after"),
    ),
    Mistake(
        "sites of the only two radars exchanged",
        alone(exchanged(RADAR, "35-10"), RADAR, "35-10"),
        command=TRACK,
        message=(
            "26-10: its site is probably the site of 35-10, and the other way round",
            "(or the azimuths of both radars are off by 180°)",
        ),
        sensors=(RADAR, "35-10"),
    ),
    Mistake(
        "azimuths of the only two radars off by 5°",
        alone(plots(azimuth_deg=(_AZIMUTH + 5.0) % 360.0), RADAR, "35-10"),
        command=TRACK,
        message=("26-10: its azimuths are probably off by +4.8°", "35-10: its azimuths are prob"),
        sensors=(RADAR, "35-10"),
    ),
    Mistake(
        "nautical miles converted as statute miles",
        plots(RADAR, range_m=pl.col("range_m") * 1609.344 / 1852.0),
        command=TRACK,
        message=("26-10: its ranges are probably nautical miles that were converted as statute",),
    ),
    Mistake(
        "numbers of plots as track numbers",
        plots(track_number=pl.int_range(pl.len())),
        command=TRACK,
        message=("26-10: its track numbers (track_number) are probably the numbers of its plots",),
        sensors=_RADARS,
    ),
    Mistake(
        "ADS-B at 0°, 0° in every third row",
        plots(
            "adsb",
            latitude_deg=pl.col("latitude_deg") * _TWO_OF_THREE,
            longitude_deg=pl.col("longitude_deg") * _TWO_OF_THREE,
        ),
        command=TRACK,
        message=("adsb: 33% of its positions are 0°, 0°",),
        sensors=("adsb",),
    ),
    Mistake(
        "plots of kind bearing",
        plots(RADAR, kind=pl.lit("bearing")),
        command=TRACK,
        message=(
            "26-10: kind is probably wrong: 100%",
            "are of kind bearing, but have ranges",
        ),
    ),
    Mistake(
        "none: plots without heights",
        plots(height_m=pl.lit(None, pl.Float64)),
        command=TRACK,
        status=0,
        sensors=(),
    ),
)
