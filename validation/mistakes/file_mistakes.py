"""Mistakes with files, folders and feeds for check_mistakes.py.

The rows are made as those of mistakes_catalogue.py; `FILE_MISTAKES` goes after its `CATALOGUE`.
"""

from collections.abc import Callable
from pathlib import Path

import polars as pl

from validation.mistakes.mistake import (
    FOOT_M,
    RADAR,
    SENSORS,
    TRACK,
    TRACK_RADARS,
    Mistake,
    Sample,
    name_of,
    plots,
    settings,
    tables_of,
    text_of,
    write,
)
from validation.mistakes.usage_mistakes import as_it_is, tracks

_ID, _TIME = pl.col("sensor_id"), pl.col("time_s")
_START_S = 1_533_110_400.0
_SERVE = ("serve", "--sensors", "sensors.toml", "--port", "0", "--no-zenoh", "--state")
_CONVERT = ("convert", "asterix", "a.ast", "--out", "out")
_CONVERT_ADSB = ("convert", "adsb", "adsb.csv", "--out", "out")


def _plot_048(number: int) -> bytes:
    """Return a block of category 048: items 010, 140, 020, 040 and 070 of one plot."""
    time_s, azimuth_deg = 28_800.0 + 0.1 * number, 9.0 * number % 360.0
    body = bytes([0xF8, 20, 129])
    body += round(time_s * 128).to_bytes(3, "big") + b"\x40"
    body += (100 * 256).to_bytes(2, "big") + round(azimuth_deg / 360 * 2**16).to_bytes(2, "big")
    body += (0o1234).to_bytes(2, "big")
    return bytes([48]) + (len(body) + 3).to_bytes(2, "big") + body


def _coasting_062(number: int) -> bytes:
    """Return a block of category 062: an extrapolated position of one track."""
    body = bytes([0b1001_1001, 0b0000_1100, 20, 1])
    body += round((28_800 + 4 * number) * 128).to_bytes(3, "big")
    body += round((46.5 + 0.01 * number) * 2**25 / 180).to_bytes(4, "big")
    body += round(7.0 * 2**25 / 180).to_bytes(4, "big") + bytes([0, 5, 1, 1, 1, 0x80])
    return bytes([62]) + (len(body) + 3).to_bytes(2, "big") + body


def _recording(
    block: Callable[[int], bytes], copies: int = 1, lost: int = 0
) -> Callable[[Sample, Path], None]:
    """Return a function that writes an ASTERIX recording."""
    octets = b"".join(map(block, range(200))) * copies

    def made(_sample: Sample, folder: Path) -> None:
        (folder / "a.ast").write_bytes(octets[: len(octets) - lost])

    return made


def _another_feed(sample: Sample, folder: Path) -> None:
    later = sample.measurements.filter(_ID == RADAR).with_columns(_TIME + 0.12)
    write(folder, pl.concat([sample.measurements, later]).sort("time_s"), sample.sensors)


def _another_id(sample: Sample, folder: Path) -> None:
    copies = sample.measurements.filter(_ID == RADAR).with_columns(sensor_id=pl.lit("26-99"))
    tables = tables_of(sample)
    tables += [one | {"sensor": 99} for one in tables if name_of(one) == RADAR]
    frame = pl.concat([sample.measurements, copies]).sort("time_s")
    write(folder, frame, text_of(tables))


def _exchanged(sample: Sample, folder: Path) -> None:
    names = {RADAR: "35-10", "35-10": RADAR}
    frame = sample.measurements.with_columns(_ID.replace(names))
    write(folder, frame, sample.sensors)


def _reports_as_text(names: str) -> Callable[[Sample, Path], None]:
    """Return a function that writes the ADS-B reports as text, under names of the two columns."""
    columns = (_TIME, "latitude_deg", "longitude_deg", "mode_s_address", "height_m")

    def made(sample: Sample, folder: Path) -> None:
        frame = sample.measurements.filter(_ID == "adsb").select(columns)
        head = f"time,{names},icao24,height_m\n"
        (folder / "adsb.csv").write_text(head + frame.write_csv(include_header=False))

    return made


def _reported_motion(head: str, **factors: float) -> Callable[[Sample, Path], None]:
    """Return a function that writes ADS-B reports with the motion of the aircraft as text.

    The columns are in knots, feet and feet per minute, times a factor.
    """

    def made(sample: Sample, folder: Path) -> None:
        over = pl.col("mode_s_address")
        apart_s = _TIME.diff().over(over)
        north_m = pl.col("latitude_deg").diff().over(over) * 111_195.0
        cosine = pl.col("latitude_deg").radians().cos()
        east_m = pl.col("longitude_deg").diff().over(over) * 111_195.0 * cosine
        frame = sample.measurements.filter(_ID == "adsb").sort("mode_s_address", "time_s")
        speed = (north_m**2 + east_m**2).sqrt() / apart_s / (1852.0 / 3600.0)
        rate = pl.col("height_m").diff().over(over) / apart_s * 60.0 / FOOT_M
        rows = frame.select(
            _TIME,
            "latitude_deg",
            pl.col("longitude_deg") * factors.get("longitude", 1.0),
            over,
            pl.col("height_m") / FOOT_M * factors.get("height", 1.0),
            (speed * factors.get("speed", 1.0)).alias("speed"),
            (rate * factors.get("rate", 1.0)).alias("rate"),
            (pl.arctan2(east_m, north_m).degrees() % 360.0).alias("track"),
        ).sort("time_s")
        text = f"time,lat,lon,icao24,{head},track\n"
        (folder / "adsb.csv").write_text(text + rows.write_csv(include_header=False))

    return made


def _sensors_as_table(sample: Sample, folder: Path) -> None:
    as_it_is(sample, folder)
    (folder / "measurements.parquet").replace(folder / "sensors.toml")
    sample.measurements.write_parquet(folder / "measurements.parquet")


FILE_MISTAKES: tuple[Mistake, ...] = (
    # Feeds and names.
    Mistake(
        "two feeds of a radar, 0.12 s apart",
        _another_feed,
        status=0,
        message=("26-10: its measurements are probably in the recording twice, from two feeds",),
    ),
    Mistake(
        "a radar under two ids",
        _another_id,
        message=("26-99: 100% of its plots are also plots of 26-10",),
    ),
    Mistake(
        "ids of two radars exchanged",
        _exchanged,
        message=("26-10: its site is probably the site of 35-10",),
        sensors=(RADAR, "35-10"),
    ),
    Mistake(
        "a clock that drifts by 2 ms each second",
        plots(RADAR, time_s=_TIME + 0.002 * (_TIME - _START_S)),
        message=("26-10: its clock probably drifts by",),
    ),
    Mistake(
        "azimuths of one radar off by 2.5°, without ADS-B",
        plots(RADAR, azimuth_deg=(pl.col("azimuth_deg") + 2.5) % 360.0),
        status=0,
        message=("26-10: the estimated azimuth offset is +2.3",),
    ),
    Mistake(
        "negative ranges",
        plots(RADAR, range_m=-pl.col("range_m")),
        message=("26-10: 100% of its", "range_m is negative (-", "write ranges above 0"),
    ),
    Mistake(
        "heights in metres, converted from feet once more",
        plots(RADAR, height_m=FOOT_M * pl.col("height_m")),
        message=("26-10: its heights are probably in metres converted once more",),
    ),
    Mistake(
        "a height of 2400 in place of 240 for one of two radars at one place",
        settings("41-10", height_m=2400.0),
        message=(
            "41-10 and 41-1 are at the same position, but their height_m differs: 2400 and 240",
        ),
    ),
    Mistake(
        "range and height exchanged",
        plots(RADAR, range_m=pl.col("height_m"), height_m=pl.col("range_m")),
        message=("26-10: its range and height columns are probably swapped",),
    ),
    Mistake(
        "azimuth and height exchanged",
        plots(RADAR, azimuth_deg=pl.col("height_m"), height_m=pl.col("azimuth_deg")),
        message=("26-10: its height and azimuth columns are probably swapped",),
    ),
    Mistake(
        "times of one radar in milliseconds",
        plots(RADAR, time_s=1e3 * _TIME),
        message=("26-10: its times are probably in milliseconds",),
    ),
    Mistake(
        "half of the azimuths missing",
        plots(RADAR, azimuth_deg=pl.when(pl.int_range(pl.len()) % 2 == 0).then("azimuth_deg")),
        message=("azimuth_deg: missing; expected a value for this kind",),
    ),
    Mistake(
        "times counted from 1900",
        lambda sample, folder: write(
            folder, sample.measurements.with_columns(_TIME + 2_208_988_800.0), sample.sensors
        ),
        status=0,
        message=("in the future; do they count from an epoch other than 1970-01-01?",),
    ),
    Mistake(
        "convert: latitude and longitude of ADS-B exchanged",
        _reports_as_text("lon,lat"),
        ("convert", "adsb", "adsb.csv", "--out", "out"),
        message=("adsb: latitude and longitude are probably swapped",),
        sensors=("adsb",),
    ),
    Mistake(
        "convert: longitudes of ADS-B with the wrong sign",
        _reported_motion("altitude,groundspeed,vertical_rate", longitude=-1.0),
        _CONVERT_ADSB,
        message=("adsb: its longitudes probably have the wrong sign",),
        sensors=("adsb",),
    ),
    Mistake(
        "none: ADS-B with speeds and vertical rates",
        _reported_motion("altitude,groundspeed,vertical_rate"),
        _CONVERT_ADSB,
        0,
    ),
    Mistake(
        "convert: ground speeds in m/s in a column of knots",
        _reported_motion("altitude,groundspeed,vertical_rate", speed=1852.0 / 3600.0),
        _CONVERT_ADSB,
        message=("adsb: its ground speeds are probably in m/s in a column of knots",),
        sensors=("adsb",),
    ),
    Mistake(
        "convert: ground speeds in knots in a column of m/s",
        _reported_motion("altitude,groundspeed_mps,vertical_rate"),
        _CONVERT_ADSB,
        message=("adsb: its ground speeds are probably in knots in a column of m/s",),
        sensors=("adsb",),
    ),
    Mistake(
        "convert: vertical rates in m/s in a column of ft/min",
        _reported_motion("altitude,groundspeed,vertical_rate", rate=FOOT_M / 60.0),
        _CONVERT_ADSB,
        message=("adsb: its vertical rates are probably in m/s in columns of ft/min",),
        sensors=("adsb",),
    ),
    Mistake(
        "convert: altitudes in metres in a column of feet",
        _reported_motion("altitude,groundspeed,vertical_rate", height=FOOT_M),
        _CONVERT_ADSB,
        message=("adsb: its heights are probably in metres in a column of feet",),
        sensors=("adsb",),
    ),
    Mistake(
        "convert: altitudes in feet in a column of metres",
        _reported_motion("altitude_m,groundspeed,vertical_rate"),
        _CONVERT_ADSB,
        message=("adsb: its heights are probably in feet",),
        sensors=("adsb",),
    ),
    Mistake(
        "low traffic with heights in feet",
        plots(height_m=(pl.col("height_m") - 25_000.0 * FOOT_M).clip(300.0) / FOOT_M),
        message=(
            f"{RADAR}: its heights are probably in feet: half of the climb and descent rates",
        ),
        sensors=SENSORS,
    ),
    Mistake(
        "heights of ADS-B in feet",
        plots("adsb", height_m=pl.col("height_m") / FOOT_M),
        TRACK,
        message=("adsb: its heights are probably in feet",),
        sensors=("adsb",),
    ),
    Mistake(
        "times as 32-bit floating-point numbers",
        plots(*SENSORS, time_s=_TIME.cast(pl.Float32).cast(pl.Float64)),
        TRACK,
        message=("26-10: its times were probably stored as 32-bit floating-point numbers",),
        sensors=SENSORS,
    ),
    Mistake(
        "none: ADS-B as text",
        _reports_as_text("lat,lon"),
        ("convert", "adsb", "adsb.csv", "--out", "out"),
        0,
    ),
    # Files.
    Mistake(
        "a sensors file as the settings",
        as_it_is,
        (*TRACK_RADARS, "--config", "sensors.toml"),
        1,
        ("sensors.toml: expected a settings file, was a sensors file",),
    ),
    Mistake(
        "settings as the sensors file",
        lambda sample, folder: write(folder, sample.measurements, "[tracking]\nepoch_s = 4.0\n"),
        message=("sensors.toml: expected a sensors file, was a settings file",),
    ),
    Mistake(
        "a decimal comma in the sensors file",
        lambda sample, folder: write(
            folder, sample.measurements, sample.sensors.replace("46.4247", "46,4247")
        ),
        message=("not valid TOML", "write 46.4247 for 46,4247"),
    ),
    Mistake(
        "a table as the sensors file",
        _sensors_as_table,
        TRACK_RADARS,
        1,
        ("sensors.toml: expected TOML, was the output of `convert`",),
    ),
    Mistake(
        "inspect: a recording cut short",
        _recording(_plot_048, lost=9),
        ("inspect", "a.ast"),
        1,
        ("the file ends inside the block", "probably truncated during copying"),
    ),
    Mistake(
        "inspect: a recording appended to itself",
        _recording(_plot_048, 2),
        ("inspect", "a.ast"),
        0,
        ("a.ast: contains the same content 2 times",),
    ),
    Mistake(
        "convert: a recording appended to itself",
        _recording(_plot_048, 3),
        _CONVERT,
        0,
        ("a.ast: contains the same content 3 times",),
    ),
    Mistake(
        "inspect: an edition of a category that is not recorded",
        _recording(_plot_048),
        ("inspect", "a.ast", "--edition", "021=0.26"),
        1,
        ("--edition 021=0.26: not in the recording, which contains 048 of 20-129",),
    ),
    Mistake(
        "convert: a day in the future",
        _recording(_plot_048),
        (*_CONVERT, "--date", "2218-08-01"),
        0,
        ("date 2218-08-01: in the future",),
    ),
    Mistake(
        "convert: system tracks that only coast",
        _recording(_coasting_062),
        _CONVERT,
        0,
        ("none of the 200 system track updates is based on a measurement",),
    ),
    # Folders.
    Mistake(
        "convert: a folder in place of ADS-B files",
        lambda _sample, folder: (folder / "adsb.csv").mkdir(),
        _CONVERT_ADSB,
        message=("adsb.csv: expected a file, was a folder; specify the files in it",),
    ),
    Mistake(
        "tracks and reference exchanged",
        tracks(lambda reports: reports),
        ("evaluate", "measurements.parquet", "--adsb", "tracks.parquet"),
        1,
        ("tracks and reference are swapped",),
    ),
    Mistake(
        "serve: a converted recording as its state",
        as_it_is,
        (*_SERVE, "."),
        1,
        ("expected a folder with a journal, was the output of `convert`",),
    ),
)
