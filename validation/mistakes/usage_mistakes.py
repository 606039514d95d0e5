"""Mistakes of usage for check_mistakes.py: names, options, files, folders, times.

The rows are made as those of mistakes_catalogue.py; `USAGE_MISTAKES` goes after its `CATALOGUE`.
"""

import gzip
import shutil
from collections.abc import Callable
from pathlib import Path

import polars as pl

from validation.mistakes.mistake import SECONDS_PER_DAY, TRACK, Mistake, Sample, write

Made = Callable[[Sample, Path], None]

_EVALUATE = ("evaluate", "tracks.parquet", "--adsb", "measurements.parquet")
_SIMULATE = ("simulate", "scenario.toml", "--out", "out")
_CONVERT = ("convert", "vid", "dump", "out")
_SERVE = ("serve", "--sensors", "sensors.toml", "--port", "0", "--no-zenoh")
#: An address without a service: the port of the obsolete discard service.
_NO_SERVICE = "127.0.0.1:9"


def nothing(_sample: Sample, _folder: Path) -> None:
    """Write no file."""


def as_it_is(sample: Sample, folder: Path) -> None:
    """Write the sample without a mistake."""
    write(folder, sample.measurements, sample.sensors)


def sensors(change: Callable[[str], str]) -> Made:
    """Return a function that changes the text of the sensors file."""
    return lambda sample, folder: write(folder, sample.measurements, change(sample.sensors))


def file(name: str, content: str | bytes) -> Made:
    """Return a function that writes a file beside the sample."""

    def made(sample: Sample, folder: Path) -> None:
        as_it_is(sample, folder)
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content.encode() if isinstance(content, str) else content)

    return made


def cut(sample: Sample, folder: Path) -> None:
    """Write a truncated table."""
    as_it_is(sample, folder)
    path = folder / "measurements.parquet"
    path.write_bytes(path.read_bytes()[:10_000])


def cut_archive(_sample: Sample, folder: Path) -> None:
    """Write a truncated compressed file."""
    rows = "".join(f"{k},{45.0 + k / 1e4},6.1,3c09df,9000\n" for k in range(20_000))
    packed = gzip.compress(f"timestamp,latitude,longitude,icao24,altitude\n{rows}".encode())
    (folder / "adsb.csv.gz").write_bytes(packed[: len(packed) // 2])


def dump(change: Callable[[Path], None]) -> Made:
    """Return a function that damages a copy of the dump."""

    def made(sample: Sample, folder: Path) -> None:
        shutil.copytree(sample.dump, folder / "dump")
        change(folder / "dump")

    return made


def tracks(change: Callable[[pl.DataFrame], pl.DataFrame]) -> Made:
    """Return a function that writes tracks equal to the ADS-B reports, and changed reports."""

    def made(sample: Sample, folder: Path) -> None:
        reports = sample.measurements.filter(kind="adsb")
        reports.select(
            "time_s",
            pl.col("track_number").alias("track_id"),
            "latitude_deg",
            "longitude_deg",
            "height_m",
            speed_mps=pl.lit(200.0),
            heading_deg=pl.lit(90.0),
            position_sigma_m=pl.lit(50.0),
            velocity_sigma_mps=pl.lit(5.0),
            state=pl.lit("confirmed"),
            sensor_id=pl.lit("26-10"),
        ).write_parquet(folder / "tracks.parquet")
        change(reports).write_parquet(folder / "measurements.parquet")

    return made


def _later(seconds: float) -> Callable[[pl.DataFrame], pl.DataFrame]:
    return lambda reports: reports.with_columns(pl.col("time_s") + seconds)


def _displaced(reports: pl.DataFrame) -> pl.DataFrame:
    """Return reports 500 m to the north-east."""
    north_m, east_m, cosine = 400.0, 300.0, pl.col("latitude_deg").radians().cos()
    return reports.with_columns(
        pl.col("latitude_deg") + north_m / 111_195.0,
        pl.col("longitude_deg") + east_m / 111_195.0 / cosine,
    )


def _of_one_aircraft(reports: pl.DataFrame) -> pl.DataFrame:
    return reports.filter(pl.col("track_number") == pl.col("track_number").first())


USAGE_MISTAKES: tuple[Mistake, ...] = (
    # Names on the command line.
    Mistake("a misspelt command", nothing, ("trakc",), 2, ("'trakc' (did you mean 'track'?)",)),
    Mistake(
        "a misspelt option",
        nothing,
        ("track", "m.parquet", "--sesnors", "s.toml", "--out", "out"),
        2,
        ("unknown option '--sesnors' (did you mean '--sensors'?)",),
    ),
    Mistake("a missing option", nothing, ("track", "m"), 2, ("missing option --sensors FILE",)),
    Mistake("a missing argument", nothing, ("track",), 2, ("missing argument MEASUREMENTS",)),
    Mistake(
        "a misspelt filter", nothing, (*TRACK, "--filter", "im"), 2, ("(did you mean 'imm'?)",)
    ),
    Mistake("a misspelt kind", nothing, (*TRACK, "--kinds", "rader"), 2, ("mean 'radar'?",)),
    Mistake("a misspelt field", nothing, (*TRACK, "--hide", "mode3a"), 2, ("mean 'mode_3a'?",)),
    Mistake("a misspelt study", nothing, ("study", "bias"), 2, ("mean 'bias-estimation'?",)),
    Mistake(
        "a misspelt scenario",
        nothing,
        ("simulate", "clutte", "--out", "o"),
        2,
        ("mean 'clutter'?",),
    ),
    Mistake("an option twice", nothing, (*TRACK, "--out", "b"), 2, ("--out: given 2 times",)),
    Mistake("an empty argument", nothing, ("track", ""), 2, ("empty argument after 'track'",)),
    Mistake(
        "a name with a blank, not quoted",
        nothing,
        ("convert", "vid", "my", "dump", "out"),
        2,
        ("quote names that contain spaces",),
    ),
    Mistake("a negative port", nothing, ("serve", "--port", "-1"), 2, ("from 0 to 65535",)),
    Mistake("an epoch of nan", as_it_is, (*TRACK, "--epoch-s", "nan"), 2, ("finite number",)),
    Mistake("a day that is none", nothing, (*TRACK, "--date", "2018-02-30"), 2, ("2018-08-01",)),
    Mistake(
        "a date for an input that is already converted",
        as_it_is,
        (*TRACK, "--date", "2018-08-01"),
        2,
        ("already converted",),
    ),
    # Keys and values of files.
    Mistake(
        "a misspelt key of a sensor",
        sensors(lambda text: text.replace("latitude_deg", "latitud_deg", 1)),
        TRACK,
        1,
        (
            "2 errors",
            "line 4",
            "26-10",
            "'latitud_deg' (did you mean 'latitude_deg'?)",
            "missing",
        ),
    ),
    Mistake(
        "several wrong values of sensors",
        sensors(
            lambda text: text.replace("46.4247", "4642.47").replace(
                "rotation_period_s = 4.9", "rpm = 12"
            )
        ),
        TRACK,
        1,
        ("2 errors", "from -90 to 90", "was 4642.47", "unknown key 'rpm'"),
    ),
    Mistake(
        "fields that a template leaves to fill in",
        sensors(lambda text: text.replace("6.0994", "nan").replace("8.3969", "nan")),
        TRACK,
        1,
        ("2 fields to fill in: 26-10 longitude_deg (line", "35-10 longitude_deg (line"),
    ),
    Mistake(
        "the range of a radar in km",
        sensors(lambda text: text.replace("range_max_m = 300000", "range_max_m = 300")),
        TRACK,
        1,
        ("26-10", "range_max_m", "from 500 to 1000000 (m), was 300"),
    ),
    Mistake(
        "[sensor] for [[sensor]]",
        sensors(lambda text: text.replace("[[sensor]]", "[sensor]")),
        TRACK,
        1,
        ("write [[sensor]] for each [sensor]",),
    ),
    Mistake(
        "[[sensors]] for [[sensor]]",
        sensors(lambda text: text.replace("[[sensor]]", "[[sensors]]")),
        TRACK,
        1,
        ("unknown key 'sensors' (did you mean 'sensor'?)",),
    ),
    Mistake("no TOML", sensors(lambda text: text + "\n[[sensor\n"), TRACK, 1, ("not valid TOML",)),
    Mistake(
        "a misspelt section of the settings",
        file("settings.toml", "[traking]\nepoch_s = 4\n"),
        (*TRACK, "--config", "settings.toml"),
        1,
        ("settings.toml", "line 1", "'traking' (did you mean 'tracking'?)"),
    ),
    Mistake(
        "a setting outside its section",
        file("settings.toml", "epoch_s = 4\n"),
        (*TRACK, "--config", "settings.toml"),
        1,
        ("line 1", "'epoch_s'; this setting belongs in [tracking]"),
    ),
    Mistake(
        "a misspelt key of a scenario",
        file("scenario.toml", "duraton_s = 60\n"),
        _SIMULATE,
        1,
        ("line 1", "'duraton_s' (did you mean 'duration_s'?)"),
    ),
    Mistake(
        "a misspelt key of a profile",
        file("profile.toml", "[units]\nrnge = 'km'\n"),
        (*_CONVERT, "--profile", "profile.toml"),
        1,
        ("profile.toml", "line 2", "'rnge' (did you mean 'range'?)"),
    ),
    # Files and folders.
    Mistake("no such file", nothing, TRACK, 1, ("sensors.toml: no such file",)),
    Mistake("a table cut short", cut, TRACK, 1, ("expected measurements in Parquet",)),
    Mistake(
        "text as a table",
        file("measurements.parquet", "time,range\n1,2\n"),
        TRACK,
        1,
        ("expected measurements in Parquet",),
    ),
    Mistake(
        "a table of something else",
        lambda sample, folder: write(
            folder, sample.measurements.drop("kind", "range_m"), sample.sensors
        ),
        TRACK,
        1,
        ("missing columns kind, range_m; found: time_s",),
    ),
    Mistake(
        "an output folder that exists",
        file("out/notes.txt", "mine"),
        TRACK,
        1,
        ("out: already exists; choose another output directory",),
    ),
    Mistake(
        "a folder without a dump",
        file("dump/a.txt", "x"),
        _CONVERT,
        1,
        ("dump: expected a folder with the text files of a dump",),
    ),
    Mistake(
        "a dump without ADS-B",
        dump(lambda path: (path / "plots_ads.txt").unlink()),
        _CONVERT,
        1,
        ("plots_ads.txt", "--allow-missing"),
    ),
    Mistake(
        "a sensor that is not in the dump",
        dump(lambda _path: None),
        (*_CONVERT, "--sensor-only", "99"),
        1,
        ("no rows from sensor 99; sensors found:",),
    ),
    Mistake(
        "text as an ASTERIX recording",
        file("a.ast", "time;range\n1;2\n"),
        ("convert", "asterix", "a.ast", "--out", "out"),
        1,
        ("no ASTERIX block can be decoded", "probably not an ASTERIX recording"),
    ),
    Mistake(
        "a packed file cut short",
        cut_archive,
        ("convert", "adsb", "adsb.csv.gz", "--out", "out"),
        1,
        ("truncated",),
    ),
    Mistake("serve without a sensors file", nothing, _SERVE, 1, ("sensors.toml: no such file",)),
    # Times, areas, references.
    Mistake(
        "a reference of the next day",
        tracks(_later(SECONDS_PER_DAY)),
        _EVALUATE,
        1,
        ("do not overlap in time", "2018-08-02 08:00:00 UTC", "1 day after the tracks"),
    ),
    Mistake(
        "a reference without its date",
        tracks(_later(-17_744.0 * SECONDS_PER_DAY)),
        _EVALUATE,
        1,
        ("do not overlap in time", "only times of day", "--date"),
    ),
    Mistake(
        "a reference of another area",
        tracks(lambda reports: reports.with_columns(pl.col("longitude_deg") + 5.0)),
        _EVALUATE,
        1,
        ("no track comes within 2000 m", "longitude"),
    ),
    Mistake(
        "a reference displaced by 500 m",
        tracks(_displaced),
        _EVALUATE,
        1,
        ("all tracks are displaced by about 50", "m to the south-west of the reference"),
    ),
    Mistake(
        "a converted recording to reprocess",
        as_it_is,
        ("reprocess", ".", "--sensors", "sensors.toml", "--out", "../out"),
        1,
        ("expected a folder with day folders", "was the output of `convert`"),
    ),
    Mistake(
        "a sensors file without a sensor",
        sensors(lambda _: "# none yet\n"),
        TRACK,
        1,
        ("sensors.toml: sensor: missing; write [[sensor]]",),
    ),
    Mistake(
        "a reference of one aircraft",
        tracks(_of_one_aircraft),
        _EVALUATE,
        0,
        ("match none of the 1 reference aircraft", "use --partial"),
    ),
    Mistake(
        "measurements as tracks",
        as_it_is,
        ("evaluate", ".", "--adsb", "."),
        1,
        ("expected the output of `track`, was the output of `convert`",),
    ),
    Mistake("no reference", nothing, ("evaluate", "tracks"), 2, ("missing reference: one of",)),
    # Services that are not running.
    Mistake(
        "a replay to a service that is not running",
        as_it_is,
        ("replay", "measurements.parquet", "--to", f"http://{_NO_SERVICE}"),
        1,
        ("retrying for 5 s", "gave up after 5 s", "multiradar serve"),
    ),
    Mistake(
        "a table as datagrams",
        as_it_is,
        ("replay", "measurements.parquet", "--to", f"udp:{_NO_SERVICE}"),
        1,
        ("expected ASTERIX blocks, found",),
    ),
)
