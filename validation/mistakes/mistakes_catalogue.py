"""The mistakes that check_mistakes.py makes: one row each, in `CATALOGUE`.

A row takes the converted sample (a table of measurements and the text of its sensors file), makes
one mistake in a copy, and defines the command, the exit status and parts of the expected message.
To add a mistake, add a row; `prepare` may write any files into its folder, where the command runs.
"""

import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from math import cos, pi, radians
from pathlib import Path
from typing import Any

import polars as pl

from multiradar.diagnosis.plots import ground_range
from multiradar.simulation.scenario.toml_text import toml_text

FOOT_M = 0.3048
NAUTICAL_MILE_M = 1852.0
SECONDS_PER_DAY = 86_400.0

#: The radar of most mistakes; the sample has three others and ADS-B.
RADAR = "26-10"

#: All sensors of the sample.
SENSORS = (RADAR, "35-10", "41-1", "41-10", "adsb")

TRACK = ("track", "measurements.parquet", "--sensors", "sensors.toml", "--out", "out")
TRACK_RADARS = (*TRACK, "--kinds", "radar")


@dataclass(frozen=True)
class Sample:
    """The sample recording.

    Attributes
    ----------
    dump : Path
        Folder of its text files.
    measurements : DataFrame
        The same, converted.
    sensors : str
        Text of its sensors file.
    """

    dump: Path
    measurements: pl.DataFrame
    sensors: str


@dataclass(frozen=True)
class Mistake:
    """One row of the catalogue.

    Attributes
    ----------
    name : str
        The mistake.
    prepare : callable
        Writes the files of the command into a folder.
    command : tuple of str
        Arguments of `multiradar`, run in that folder.
    status : int
        The expected exit status.
    message : tuple of str
        Parts of the expected message on standard error.
    sensors : tuple of str
        The sensors of the sample that messages may name first; no other may be diagnosed.
    """

    name: str
    prepare: Callable[[Sample, Path], None]
    command: tuple[str, ...] = TRACK_RADARS
    status: int = 1
    message: tuple[str, ...] = ()
    sensors: tuple[str, ...] = (RADAR,)


def write(folder: Path, measurements: pl.DataFrame, sensors: str) -> None:
    """Write a converted recording with its sensors file."""
    measurements.write_parquet(folder / "measurements.parquet")
    (folder / "sensors.toml").write_text(sensors, encoding="utf-8")


# ---------------------------------------------------------------- functions that make mistakes


def plots(
    *sensors: str, anonymous: bool = False, **columns: pl.Expr
) -> Callable[[Sample, Path], None]:
    """Return a function that replaces columns in the plots of sensors; of all radars if none."""

    def made(sample: Sample, folder: Path) -> None:
        chosen = pl.col("sensor_id").is_in(sensors) if sensors else pl.col("kind") == "radar"
        frame = sample.measurements.with_columns(
            pl.when(chosen).then(one).otherwise(pl.col(name)).alias(name)
            for name, one in columns.items()
        )
        write(folder, without_identity(frame) if anonymous else frame, sample.sensors)

    return made


def without_identity(frame: pl.DataFrame) -> pl.DataFrame:
    """Return plots as of a primary radar: range, azimuth and height only."""
    radar = pl.col("kind") == "radar"
    names = ("track_number", "mode_s_address", "mode_3a", "latitude_deg", "longitude_deg")
    return frame.with_columns(
        pl.when(radar).then(None).otherwise(pl.col(name)).alias(name) for name in names
    )


def settings(
    *sensors: str, anonymous: bool = False, **values: Any
) -> Callable[[Sample, Path], None]:
    """Return a function that replaces values in the sensors file; a callable gets the old value."""

    def made(sample: Sample, folder: Path) -> None:
        tables = tables_of(sample)
        for table in tables:
            if name_of(table) in sensors:
                table |= {
                    name: value(table) if callable(value) else value
                    for name, value in values.items()
                }
        frame = sample.measurements
        write(folder, without_identity(frame) if anonymous else frame, text_of(tables))

    return made


def tables_of(sample: Sample) -> list[dict[str, Any]]:
    """Return the tables of the sensors file."""
    return list(tomllib.loads(sample.sensors)["sensor"])


def name_of(table: dict[str, Any]) -> str:
    """Return the id of a sensor."""
    return str(table.get("id", f"{table.get('source')}-{table.get('sensor')}"))


def text_of(tables: list[dict[str, Any]]) -> str:
    """Return the text of a sensors file."""
    return toml_text({"sensor": tables})


def moved(east_m: float, north_m: float) -> dict[str, Any]:
    """Return the values that move a site."""
    return {
        "latitude_deg": lambda one: one["latitude_deg"] + north_m / 111_195.0,
        "longitude_deg": lambda one: (
            one["longitude_deg"] + east_m / 111_195.0 / cos(radians(one["latitude_deg"]))
        ),
    }


def exchanged(first: str, second: str) -> Callable[[Sample, Path], None]:
    """Return a function that exchanges the sites of two sensors."""

    def made(sample: Sample, folder: Path) -> None:
        tables = {name_of(table): table for table in tables_of(sample)}
        for name in ("latitude_deg", "longitude_deg", "height_m"):
            one, other = tables[first][name], tables[second][name]
            tables[first][name], tables[second][name] = other, one
        write(folder, sample.measurements, text_of(list(tables.values())))

    return made


def on_the_ground(sensor: str) -> Callable[[Sample, Path], None]:
    """Return a function that replaces slant ranges of a radar by ground ranges."""

    def made(sample: Sample, folder: Path) -> None:
        site = {name_of(table): table for table in tables_of(sample)}[sensor]
        frame = sample.measurements.filter(sensor_id=sensor)
        heights = frame["height_m"].fill_null(0.0).to_numpy()
        ground_m, _ = ground_range(float(site["height_m"]), frame["range_m"].to_numpy(), heights)
        frame = frame.with_columns(pl.Series("range_m", ground_m))
        others = sample.measurements.filter(pl.col("sensor_id") != sensor)
        write(folder, pl.concat([frame, others]).sort("time_s"), sample.sensors)

    return made


def late_and_known(sensor: str, late_s: float) -> Callable[[Sample, Path], None]:
    """Return a function that delays a clock and configures its offset in the sensors file."""
    bias = {"time_offset_s": {"prior": late_s, "estimate": False}}

    def made(sample: Sample, folder: Path) -> None:
        times = pl.col("time_s") + pl.when(sensor_id=sensor).then(late_s).otherwise(0.0)
        frame = sample.measurements.with_columns(times).sort("time_s")
        settings(sensor, bias=bias)(Sample(sample.dump, frame, sample.sensors), folder)

    return made


def nameless(**identity: str) -> Callable[[Sample, Path], None]:
    """Return a function that removes identity from plots except one value for `RADAR`."""

    def made(sample: Sample, folder: Path) -> None:
        frame = without_identity(sample.measurements)
        chosen = pl.col("sensor_id") == RADAR
        texts = [
            pl.when(chosen).then(pl.lit(text)).otherwise(pl.col(name)).alias(name)
            for name, text in identity.items()
        ]
        write(folder, frame.with_columns(texts), sample.sensors)

    return made


def renumbered(sensor: str, source: int) -> Callable[[Sample, Path], None]:
    """Return a function that changes the source number of a sensor in the sensors file."""
    return settings(sensor, source=source)


def other_installation(sample: Sample, folder: Path) -> None:
    """Write the sensors of another country: other numbers, other sites."""
    tables = [
        {**table, "source": int(str(table["source"])) + 100, "latitude_deg": 40.0 + number,
         "longitude_deg": -4.0 + number}
        for number, table in enumerate(one for one in tables_of(sample) if "source" in one)
    ]  # fmt: skip
    write(folder, sample.measurements, text_of(tables))


def other_sites(sample: Sample, folder: Path) -> None:
    """Write the right numbers with the sites of another country, each moved differently."""
    tables = tables_of(sample)
    for number, table in enumerate(one for one in tables if "source" in one):
        table |= {"latitude_deg": 40.0 + 0.5 * number, "longitude_deg": -4.0 + 1.5 * number**2}
    write(folder, sample.measurements, text_of(tables))


def only(*sensors: str) -> Callable[[Sample], Sample]:
    """Return a function that keeps only some sensors in the recording and the sensors file."""

    def kept(sample: Sample) -> Sample:
        tables = [table for table in tables_of(sample) if name_of(table) in sensors]
        frame = sample.measurements.filter(pl.col("sensor_id").is_in(sensors))
        return Sample(sample.dump, frame, text_of(tables))

    return kept


def alone(made: Callable[[Sample, Path], None], *sensors: str) -> Callable[[Sample, Path], None]:
    """Return a mistake in a recording of only some sensors."""
    return lambda sample, folder: made(only(*sensors)(sample), folder)


def doubled(*sensors: str) -> Callable[[Sample, Path], None]:
    """Return a function that writes the plots of some sensors twice."""

    def made(sample: Sample, folder: Path) -> None:
        frame = sample.measurements
        again = frame.filter(pl.col("sensor_id").is_in(sensors))
        write(folder, pl.concat([frame, again]).sort("time_s", maintain_order=True), sample.sensors)

    return made


def right(sample: Sample, folder: Path) -> None:
    """Make no mistake."""
    write(folder, sample.measurements, sample.sensors)


def anonymous(sample: Sample, folder: Path) -> None:
    """Make no mistake, with plots that identify no aircraft."""
    write(folder, without_identity(sample.measurements), sample.sensors)


def dump(**edits: Callable[[list[list[str]]], list[list[str]]]) -> Callable[[Sample, Path], None]:
    """Return a function that edits the rows of files of the dump, and writes the sensors file."""

    def made(sample: Sample, folder: Path) -> None:
        (folder / "dump").mkdir()
        for name in ("plots", "plots_ads", "tracks"):
            text = (sample.dump / f"{name}.txt").read_text(encoding="ascii")
            if name in edits:
                rows = [line.split("\t") for line in text.splitlines()]
                text = "".join("\t".join(row) + "\n" for row in edits[name](rows))
            (folder / "dump" / f"{name}.txt").write_text(text, encoding="ascii")
        (folder / "sensors.toml").write_text(sample.sensors, encoding="utf-8")

    return made


def column_times(column: str, factor: float) -> Callable[[list[list[str]]], list[list[str]]]:
    """Return a function that multiplies a column of a file of the dump."""

    def edited(rows: list[list[str]]) -> list[list[str]]:
        index = rows[0].index(column)
        for row in rows[1:]:
            try:
                row[index] = f"{float(row[index]) * factor:.6f}"
            except (ValueError, IndexError):
                continue
        return rows

    return edited


def other_separator(rows: list[list[str]]) -> list[list[str]]:
    """Return rows with semicolons instead of tabs, except the header."""
    return [rows[0], *([";".join(row)] for row in rows[1:])]


_RANGE, _AZIMUTH, _TIME, _HEIGHT = (
    pl.col(name) for name in ("range_m", "azimuth_deg", "time_s", "height_m")
)
_RADIANS = pi / 180.0
CONVERT = ("convert", "vid", "dump", "out", "--date", "2018-08-01")

CATALOGUE: tuple[Mistake, ...] = (
    Mistake("none: the sample as it is", right, status=0),
    Mistake("none: with ADS-B", right, TRACK, status=0),
    Mistake("none: plots without identity", anonymous, status=0),
    # Ranges.
    Mistake(
        "ranges in kilometres", plots(RADAR, range_m=_RANGE / 1e3), message=(RADAR, "kilometres")
    ),
    Mistake(
        "ranges in nautical miles",
        plots(RADAR, range_m=_RANGE / NAUTICAL_MILE_M),
        message=(RADAR, "nautical miles"),
    ),
    Mistake("ranges in feet", plots(RADAR, range_m=_RANGE / FOOT_M), message=(RADAR, "feet")),
    Mistake(
        "ranges in kilometres, plots without identity",
        plots(RADAR, anonymous=True, range_m=_RANGE / 1e3),
        message=(RADAR, "kilometres"),
    ),
    Mistake(
        "ranges of all radars in kilometres",
        plots(range_m=_RANGE / 1e3),
        message=("kilometres",),
        sensors=SENSORS,
    ),
    Mistake(
        "ranges of the only radar in kilometres, plots without identity",
        alone(plots(anonymous=True, range_m=_RANGE / 1e3), RADAR),
        message=(RADAR, "kilometres"),
    ),
    Mistake(
        "ground ranges in place of slant ranges",
        on_the_ground(RADAR),
        message=(RADAR, "ground ranges"),
    ),
    Mistake(
        "a range_max_m in kilometres", settings(RADAR, range_max_m=300), message=("range_max_m",)
    ),
    Mistake(
        "a range_max_m in nautical miles",
        settings(RADAR, range_max_m=162),
        message=("range_max_m",),
    ),
    # Azimuths.
    Mistake(
        "azimuths in radians", plots(RADAR, azimuth_deg=_AZIMUTH * _RADIANS), message=("radians",)
    ),
    Mistake(
        "azimuths in radians, plots without identity",
        plots(RADAR, anonymous=True, azimuth_deg=_AZIMUTH * _RADIANS),
        message=(RADAR, "radians"),
    ),
    Mistake(
        "azimuths of the only radar in radians, plots without identity",
        alone(plots(RADAR, anonymous=True, azimuth_deg=_AZIMUTH * _RADIANS), RADAR),
        message=(RADAR, "radians"),
    ),
    Mistake(
        "azimuths in milliradians",
        plots(RADAR, azimuth_deg=_AZIMUTH * _RADIANS * 1e3),
        message=(RADAR, "milliradians"),
    ),
    Mistake(
        "azimuths in gradians", plots(RADAR, azimuth_deg=_AZIMUTH / 0.9), message=("gradians",)
    ),
    Mistake(
        "azimuths anticlockwise",
        plots(RADAR, azimuth_deg=(360.0 - _AZIMUTH) % 360.0),
        message=(RADAR, "anticlockwise"),
    ),
    Mistake(
        "azimuths anticlockwise from east",
        plots(RADAR, azimuth_deg=(450.0 - _AZIMUTH) % 360.0),
        message=(RADAR, "anticlockwise"),
    ),
    Mistake(
        "azimuths of the only radar anticlockwise, plots without identity",
        alone(plots(anonymous=True, azimuth_deg=(360.0 - _AZIMUTH) % 360.0), RADAR),
        message=(RADAR, "anticlockwise"),
    ),
    Mistake(
        "azimuths off by 90°",
        plots(RADAR, azimuth_deg=(_AZIMUTH + 90.0) % 360.0),
        message=(RADAR, "off by +89.8°"),
    ),
    Mistake(
        "azimuths off by 180°, plots without identity",
        plots(RADAR, anonymous=True, azimuth_deg=(_AZIMUTH + 180.0) % 360.0),
        message=(RADAR, "off by +179.8°"),
    ),
    Mistake(
        "azimuths from magnetic north (4°)",
        plots(RADAR, azimuth_deg=(_AZIMUTH - 4.0) % 360.0),
        message=(RADAR, "magnetic"),
    ),
    Mistake(
        "range and azimuth exchanged",
        plots(RADAR, range_m=_AZIMUTH, azimuth_deg=_RANGE),
        message=(RADAR, "swapped"),
    ),
    # Sites.
    Mistake(
        "latitude and longitude of a site exchanged",
        settings(
            RADAR,
            latitude_deg=lambda one: 6.0994,
            longitude_deg=lambda one: 46.4247,
        ),
        message=(RADAR, "latitude_deg and longitude_deg", "swapped"),
    ),
    Mistake(
        "longitude of a site negative",
        settings(RADAR, longitude_deg=lambda one: -one["longitude_deg"]),
        message=(RADAR, "longitude_deg", "sign"),
    ),
    Mistake(
        "latitude of a site negative",
        settings(RADAR, latitude_deg=lambda one: -one["latitude_deg"]),
        message=(RADAR, "latitude_deg", "sign"),
    ),
    Mistake(
        "a site off by 5 km",
        settings(RADAR, **moved(3e3, 4e3)),
        message=(RADAR, "site is probably 5"),
    ),
    Mistake(
        "a site off by 5 km, plots without identity",
        settings(RADAR, anonymous=True, **moved(3e3, 4e3)),
        message=(RADAR, "site is probably 5"),
    ),
    Mistake(
        "a site off by 50 km",
        settings(RADAR, **moved(-4e4, 3e4)),
        message=(RADAR, "site is probably 50"),
    ),
    Mistake(
        "sites of two radars exchanged",
        exchanged(RADAR, "35-10"),
        message=(RADAR, "35-10", "site"),
        sensors=(RADAR, "35-10"),
    ),
    Mistake(
        "the height of a site in feet",
        settings(RADAR, height_m=lambda one: one["height_m"] / FOOT_M),
        message=(RADAR, "height_m of its site", "feet"),
    ),
    Mistake(
        "the height of a site in kilometres",
        settings(RADAR, height_m=lambda one: one["height_m"] / 1e3),
        message=(RADAR, "height_m of its site", "kilometres"),
    ),
    Mistake(
        "a site off by 1.1 km",
        settings(RADAR, **moved(1.1e3, 0.0)),
        message=(RADAR, "probably 1.1"),
    ),
    Mistake(
        "a site off by 0.4 km, with ADS-B",
        settings(RADAR, **moved(280.0, 280.0)),
        TRACK,
        message=(RADAR, "its site is probably 0.4", "latitude_deg and longitude_deg"),
    ),
    Mistake(
        "a site off by 0.3 km, without a sensor that shows which",
        settings(RADAR, **moved(300.0, 0.0)),
        message=(RADAR, "its site is probably 0.3"),
    ),
    Mistake(
        "sites of two radars at one place off by 0.5 km",
        settings("41-1", "41-10", **moved(350.0, 350.0)),
        message=("41-1, 41-10: its site is probably",),
        sensors=("41-1", "41-10"),
    ),
    Mistake(
        "ranges 2 % too long",
        plots(RADAR, range_m=_RANGE * 1.02),
        message=(RADAR, "its ranges are probably 2.0% too long"),
    ),
    Mistake(
        "a range offset held at 0 by a prior_sigma of 1 m (it is 185 m)",
        settings(RADAR, bias={"range_offset_m": {"prior_sigma": 1.0}}),
        message=(RADAR, "bias.range_offset_m", "increase prior_sigma"),
    ),
    # Heights.
    Mistake(
        "none: heights of a hot day",
        plots(height_m=_HEIGHT * 0.93),
        status=0,
    ),
    Mistake(
        "heights in hundreds of metres",
        plots(RADAR, height_m=_HEIGHT / 100.0),
        message=(RADAR, "hundreds of metres"),
    ),
    Mistake(
        "heights of the only radar in hundreds of metres",
        alone(plots(height_m=_HEIGHT / 100.0), RADAR),
        message=(RADAR, "hundreds of metres"),
    ),
    Mistake("heights in feet", plots(RADAR, height_m=_HEIGHT / FOOT_M), message=(RADAR, "feet")),
    Mistake(
        "heights in flight levels",
        plots(RADAR, height_m=_HEIGHT / FOOT_M / 100.0),
        message=(RADAR, "flight levels"),
    ),
    # Times.
    Mistake(
        "a clock off by 3 s", plots(RADAR, time_s=_TIME + 3.0), message=(RADAR, "clock", "s ahead")
    ),
    Mistake(
        "none: a clock off by 3 s, with bias.time_offset_s of 3 s",
        late_and_known(RADAR, 3.0),
        status=0,
    ),
    Mistake("a clock off by 1 h", plots(RADAR, time_s=_TIME + 3600.0), message=(RADAR, "1 h")),
    Mistake(
        "times of one radar of another day",
        plots(RADAR, time_s=_TIME + SECONDS_PER_DAY),
        message=(RADAR, "2018-08-02"),
    ),
    Mistake(
        "times of one radar without their date",
        plots(RADAR, time_s=_TIME % SECONDS_PER_DAY),
        message=(RADAR, "date"),
    ),
    # Names.
    Mistake(
        "a wrong source number",
        renumbered("35-10", 34),
        message=("35-10", "34-10", "sensors.toml"),
        sensors=("35-10",),
    ),
    Mistake(
        "two wrong source numbers",
        lambda sample, folder: settings(RADAR, source=27)(
            Sample(
                sample.dump,
                sample.measurements,
                text_of(
                    [
                        {**table, "source": 36} if name_of(table) == "35-10" else table
                        for table in tables_of(sample)
                    ]
                ),
            ),
            folder,
        ),
        message=("26-10", "27-10", "35-10", "36-10"),
        sensors=(RADAR, "35-10"),
    ),
    Mistake(
        "a radar under the id of the ADS-B source",
        lambda sample, folder: write(
            folder,
            sample.measurements,
            text_of(
                [
                    {
                        **{
                            key: one
                            for key, one in table.items()
                            if key not in ("source", "sensor")
                        },
                        "id": "adsb",
                    }
                    for table in tables_of(sample)
                    if name_of(table) == RADAR
                ]
                + [table for table in tables_of(sample) if name_of(table) not in (RADAR, "adsb")]
            ),
        ),
        TRACK,
        message=("adsb: the sensors file declares a radar under this id",),
        sensors=("adsb",),
    ),
    Mistake("sensors of another recording", other_installation, message=("another",)),
    Mistake(
        "the right numbers, the sites of another country",
        other_sites,
        message=("site",),
        sensors=SENSORS,
    ),
    Mistake(
        "a sensor that sent nothing",
        lambda sample, folder: write(
            folder,
            sample.measurements.filter(pl.col("sensor_id") != "41-1"),
            sample.sensors,
        ),
        message=("41-1", "no measurements"),
        sensors=("41-1",),
    ),
    Mistake(
        "one track number for all aircraft of a radar",
        plots(RADAR, track_number=pl.lit(7)),
        message=(RADAR, "track_number", "the same for all"),
    ),
    Mistake(
        "one Mode S address for all aircraft of a radar, without track numbers",
        nameless(mode_s_address="4B1805"),
        message=(RADAR, "mode_s_address", "the same for all"),
    ),
    Mistake(
        "none: Mode 3/A code 7000 for all aircraft of a radar, without track numbers",
        nameless(mode_3a="7000"),
        status=0,
    ),
    # Biases.
    Mistake(
        "a range offset fixed at 1000 m (it is 185 m)",
        settings(RADAR, bias={"range_offset_m": {"prior": 1000.0, "estimate": False}}),
        message=(RADAR, "bias.range_offset_m", "estimate = false"),
    ),
    Mistake(
        "an azimuth offset with a wrong prior and its prior_sigma 100 times too small",
        settings(RADAR, bias={"azimuth_offset_deg": {"prior": 0.3, "prior_sigma": 0.005}}),
        message=(RADAR, "bias.azimuth_offset_deg", "prior_sigma"),
    ),
    Mistake(
        "none: both offsets fixed at about the right values",
        settings(
            RADAR,
            bias={
                "range_offset_m": {"prior": 150.0, "estimate": False},
                "azimuth_offset_deg": {"prior": -0.15, "estimate": False},
            },
        ),
        status=0,
    ),
    # Noise and scan periods.
    Mistake(
        "range_sigma_m 100 times too large",
        settings(RADAR, range_sigma_m=4000),
        message=(RADAR, "range_sigma_m"),
    ),
    Mistake(
        "azimuth_sigma_deg 100 times too large",
        settings(RADAR, azimuth_sigma_deg=6.0),
        message=(RADAR, "azimuth_sigma_deg"),
    ),
    Mistake(
        "range_sigma_m 10 times too large",
        settings(RADAR, range_sigma_m=400),
        message=(RADAR, "range_sigma_m"),
    ),
    Mistake(
        "both sigmas 10 times too large",
        settings(RADAR, range_sigma_m=400, azimuth_sigma_deg=0.6),
        message=(RADAR, "range_sigma_m and azimuth_sigma_deg are probably too large"),
    ),
    Mistake(
        "range_sigma_m 100 times too small",
        settings(RADAR, range_sigma_m=0.4),
        message=(RADAR, "range_sigma_m"),
    ),
    Mistake(
        "azimuth_sigma_deg in radians",
        settings(RADAR, azimuth_sigma_deg=0.00105),
        message=(RADAR, "azimuth_sigma_deg"),
    ),
    Mistake(
        "azimuth_sigma_deg in milliradians",
        settings(RADAR, azimuth_sigma_deg=1.05),
        message=(RADAR, "azimuth_sigma_deg"),
    ),
    Mistake(
        "rotation_period_s 12 in place of 4",
        settings("35-10", rotation_period_s=12.0),
        message=("35-10", "rotation_period_s"),
        sensors=("35-10",),
    ),
    Mistake(
        "rotation_period_s in revolutions a minute",
        settings("35-10", rotation_period_s=15.0),
        message=("35-10", "rotation_period_s"),
        sensors=("35-10",),
    ),
    # Kinds, copies.
    Mistake(
        "a radar declared adsb",
        lambda sample, folder: write(
            folder,
            sample.measurements,
            text_of(
                [
                    {"id": RADAR, "kind": "adsb"} if name_of(table) == RADAR else table
                    for table in tables_of(sample)
                ]
            ),
        ),
        message=(RADAR, "kind"),
    ),
    Mistake("the plots of a radar twice", doubled(RADAR), message=(RADAR, "twice")),
    # Dumps.
    Mistake("none: the dump converted", dump(), CONVERT, status=0),
    Mistake(
        "convert: ranges in kilometres",
        dump(plots=column_times("range", 1e-3)),
        CONVERT,
        message=("kilometres",),
        sensors=SENSORS,
    ),
    Mistake(
        "convert: azimuths in radians",
        dump(plots=column_times("azimuth", _RADIANS)),
        CONVERT,
        message=("radians",),
        sensors=SENSORS,
    ),
    Mistake(
        "convert: azimuths in gradians",
        dump(plots=column_times("azimuth", 1 / 0.9)),
        CONVERT,
        message=("gradians",),
        sensors=SENSORS,
    ),
    Mistake(
        "convert: another separator", dump(plots=other_separator), CONVERT, message=("plots.txt",)
    ),
    Mistake(
        "convert: azimuths in mils (6400 to a circle)",
        dump(plots=column_times("azimuth", 6400 / 360)),
        CONVERT,
        message=("26-10: its azimuths are probably in mils (6400 to a circle)",),
        sensors=SENSORS,
    ),
    Mistake(
        "convert: azimuths in milliradians",
        dump(plots=column_times("azimuth", _RADIANS * 1e3)),
        CONVERT,
        message=("26-10: its azimuths are probably in milliradians",),
        sensors=SENSORS,
    ),
    Mistake(
        "convert: plots.txt cut short",
        dump(plots=lambda rows: rows[: len(rows) // 2]),
        CONVERT,
        message=("plots.txt: probably truncated",),
    ),
    Mistake(
        "convert: tracks.txt cut short",
        dump(tracks=lambda rows: rows[: len(rows) // 2]),
        CONVERT,
        message=("tracks.txt: probably truncated",),
    ),
    Mistake(
        "none: a dump without its date",
        dump(),
        ("track", "dump", "--sensors", "sensors.toml", "--kinds", "radar", "--out", "out"),
        status=0,
    ),
)
