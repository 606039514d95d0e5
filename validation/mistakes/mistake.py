"""The form of a mistake that check_mistakes.py makes, and functions that make them.

A row takes the converted sample (a table of measurements and the text of its sensors file), makes
one mistake in a copy, and defines the command, the exit status and parts of the expected message.
To add a mistake, add a row to a catalogue; `prepare` may write any files into its folder, where
the command runs.
"""

import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from math import cos, pi, radians
from pathlib import Path
from typing import Any

import numpy as np
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


def all_times(factor: float, *, dated: bool = True) -> Callable[[Sample, Path], None]:
    """Return a function that scales all times, from the first one or those of day."""

    def made(sample: Sample, folder: Path) -> None:
        frame, time_s = sample.measurements, pl.col("time_s")
        first_s = frame["time_s"].min() if dated else 0.0
        of_day = time_s if dated else time_s % SECONDS_PER_DAY
        time_s = first_s + (of_day - first_s) * factor
        write(folder, frame.with_columns(time_s=time_s), sample.sensors)

    return made


def reflections(share: float, sensor: str = RADAR) -> Callable[[Sample, Path], None]:
    """Return a function that adds replies by two reflectors to the plots of a radar."""

    def made(sample: Sample, folder: Path) -> None:
        generator, frame = np.random.Generator(np.random.PCG64(1)), sample.measurements
        own = frame.filter(sensor_id=sensor)
        own = own.filter(pl.Series(generator.uniform(size=len(own)) < share))
        towards = pl.Series(np.where(generator.uniform(size=len(own)) < 0.5, 40.0, 215.0))
        period_s = {name_of(one): one for one in tables_of(sample)}[sensor]["rotation_period_s"]
        later_s = (towards - own["azimuth_deg"]) % 360.0 / 360.0 * period_s
        ghosts = own.with_columns(
            pl.col("time_s") + later_s,
            pl.col("range_m") + pl.Series(generator.uniform(2e3, 9e3, len(own))),
            azimuth_deg=towards,
            latitude_deg=pl.lit(None, pl.Float64),
            longitude_deg=pl.lit(None, pl.Float64),
        )
        write(folder, pl.concat([frame, ghosts]).sort("time_s"), sample.sensors)

    return made


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


RANGE, AZIMUTH, TIME, HEIGHT = (
    pl.col(name) for name in ("range_m", "azimuth_deg", "time_s", "height_m")
)
RADIANS = pi / 180.0
CONVERT = ("convert", "vid", "dump", "out", "--date", "2018-08-01")
