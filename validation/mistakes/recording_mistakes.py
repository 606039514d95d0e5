"""Mistakes in a whole recording for check_mistakes.py: missing rows, codes, azimuths that jump.

The rows are made as those of mistakes_catalogue.py.
"""

from collections.abc import Callable
from pathlib import Path

import polars as pl

from validation.mistakes.mistake import (
    RADAR,
    SENSORS,
    Mistake,
    Sample,
    alone,
    plots,
    settings,
    write,
)

_TIME, _AZIMUTH = pl.col("time_s"), pl.col("azimuth_deg")
#: The recording starts at 2018-08-01 08:00:00 UTC.
_START_S = 1_533_110_400.0
_RADARS = SENSORS[:-1]


def _thinned(every: int) -> Callable[[Sample, Path], None]:
    """Return a function that writes one in so many rows."""
    return lambda sample, folder: write(
        folder, sample.measurements.gather_every(every), sample.sensors
    )


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
)
