"""References that come with a dump: its own system tracks, and its `truth.json`."""

import datetime as dt
import json
from collections.abc import Iterator
from pathlib import Path

import polars as pl

from multiradar.errors import InputError
from multiradar.evaluation.measures.bias_errors import TRUE_BIAS_COLUMNS
from multiradar.evaluation.reference_rows import FILE_COLUMN, LINE_COLUMN
from multiradar.evaluation.trajectories import NUMBER_MAX
from multiradar.report.times import is_dated
from multiradar.toolbox.conversion.measurements import open_measurements
from multiradar.toolbox.evaluation.dump_truth import TRUTH_FILE, Truth, read_truth_file
from multiradar.toolbox.inputs import DumpChoice

REPORT_FILE = "report.json"
_NEW4 = "_mr.new4"
_COLUMNS = ("time_s", "latitude_deg", "longitude_deg", "height_m")


def is_recorded_truth(given: Path | None) -> bool:
    """Return whether a path is the `truth.json` of a dump rather than a simulated truth."""
    if given is None:
        return False
    return given.suffix == ".json" or (
        (given / TRUTH_FILE).exists() and not (given / "truth.parquet").exists()
    )


def recorded_truth(given: Path) -> tuple[Truth, Path]:
    """Read the `truth.json` of a dump.

    Parameters
    ----------
    given : Path
        The file, or the folder of the dump.

    Raises
    ------
    InputError
        It does not exist or cannot be used.
    """
    path = given / TRUTH_FILE if given.is_dir() else given
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    return read_truth_file(path), path


def true_biases(truth: Truth) -> pl.DataFrame:
    """Return the true biases of a recording in the columns of `truth_biases.parquet`.

    They are constant.
    """
    rows = [
        (time_s, sensor, parameter, value)
        for time_s in (-NUMBER_MAX, NUMBER_MAX)
        for (sensor, parameter), value in truth.biases.items()
    ]
    kinds = (pl.Float64, pl.String, pl.String, pl.Float64)
    return pl.DataFrame(rows, schema=dict(zip(TRUE_BIAS_COLUMNS, kinds, strict=True)), orient="row")


def reports_of_dump(path: Path, truth: Truth) -> tuple[pl.DataFrame, str]:
    """Return the measurements of the dump next to a `truth.json`, converted on the fly.

    Parameters
    ----------
    path : Path
        The `truth.json`.
    truth : Truth
        Its contents.

    Returns
    -------
    DataFrame, str
        All measurements, and their name in error messages.

    Raises
    ------
    InputError
        There is no dump next to it.
    """
    dump = path.parent
    if not (dump / "plots.txt").exists():
        msg = (
            f"{path}: contains no aircraft positions, and there is no dump next to it; also "
            "specify a reference: --adsb or --system-tracks"
        )
        raise InputError(msg)
    with open_measurements(dump, DumpChoice(date=truth.date), float("inf")) as recording:
        return pl.concat(recording.blocks()), str(dump)


def has_dump_tracks(given: Path) -> bool:
    """Return whether a path is that of system tracks that `convert vid` wrote as `.new4`."""
    return given.suffix == ".new4" or (given.is_dir() and any(_track_files(given)))


def dump_tracks(given: Path) -> pl.DataFrame:
    """Read the system tracks of a dump.

    Parameters
    ----------
    given : Path
        The folder that `convert vid` made, that of one aircraft in it, or one `240_mr.new4`.

    Returns
    -------
    DataFrame
        Columns of `REPORT_COLUMNS`, and `file` and `line`; the aircraft are named by the dump's
        numbers. Times are Unix
        times where the dump was converted with a date.

    Raises
    ------
    InputError
        A file cannot be read.
    """
    from multiradar_converters.errors import ConversionError
    from multiradar_converters.track_text import new4
    from multiradar_converters.vid.text.times import unix_start

    files = [given] if given.suffix == ".new4" else sorted(_track_files(given))
    folder = files[0].parent.parent
    date = _settings(folder).get("date")
    start_s = unix_start(None if date is None else dt.date.fromisoformat(str(date)))
    parts = []
    for path in files:
        try:
            points = new4.read(path)
        except (ConversionError, UnicodeDecodeError) as error:
            raise InputError(f"{path.parent}: {error}") from error
        part = pl.DataFrame(points, schema=dict.fromkeys(_COLUMNS, pl.Float64))
        # A point is a line.
        parts.append(
            part.with_row_index(LINE_COLUMN, offset=1).with_columns(
                pl.lit(str(path)).alias(FILE_COLUMN),
                track_number=pl.lit(_number(path), pl.Int64),
            )
        )
    moved = pl.col("time_s")
    whole = pl.concat(parts)
    if whole.height and not is_dated(float(whole["time_s"].max())):  # type: ignore[arg-type]  # numbers
        moved += start_s
    no_address = pl.lit(None, pl.String).alias("mode_s_address")
    return whole.with_columns(moved, no_address, pl.col("height_m").fill_nan(None))


def _track_files(given: Path) -> Iterator[Path]:
    # Of the multiradar system in the recording, in the folders of aircraft.
    for folder in (given, given.parent):
        source = _settings(folder).get("multiradar_source", 240)
        name = f"{source}{_NEW4}"
        if (given / name).is_file():
            yield given / name
            return
    yield from given.glob(f"*/{_settings(given).get('multiradar_source', 240)}{_NEW4}")


def _settings(folder: Path) -> dict[str, object]:
    try:
        settings = json.loads((folder / REPORT_FILE).read_text(encoding="utf-8"))["settings"]
    except (OSError, ValueError, KeyError, TypeError):
        return {}
    return settings if isinstance(settings, dict) else {}


def _number(path: Path) -> int:
    name = path.parent.name
    return int(name) if name.isascii() and name.isdigit() else 0
