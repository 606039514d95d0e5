"""`multiradar export`: tracks as GeoJSON and KML."""

import datetime as dt
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from multiradar.cli.options import parse_date
from multiradar.errors import InputError, MissingColumnError
from multiradar_schemas.documents.contents import no_such, other_table, unreadable

if TYPE_CHECKING:
    import polars as pl

    from multiradar.report.track_lines import TrackLine

_TRACKS_FILE = "tracks.parquet"
_IDENTITY = ("track_id", "track_number", "mode_s_address", "mode_3a", "callsign")
_PLACE = ("time_s", "longitude_deg", "latitude_deg", "height_m")
_TENTATIVE = "tentative"

EXPORT_HELP = (
    "Export tracks as GeoJSON or KML.\n\n"
    "TRACKS is the output directory of `track`, or its tracks.parquet. Each confirmed track "
    "becomes a line with the time of every position. Heights are track heights: pressure "
    "altitudes if derived from Mode C."
)


def export(
    tracks: Annotated[
        Path, typer.Argument(metavar="TRACKS", help="Tracks to export.", show_default=False)
    ],
    *,
    geojson: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.geojson",
            help="New GeoJSON file (RFC 7946).",
            show_default=False,
        ),
    ] = None,
    kml: Annotated[
        Path | None,
        typer.Option(metavar="FILE.kml", help="New KML 2.2 file.", show_default=False),
    ] = None,
    date: Annotated[
        str | None,
        typer.Option(
            metavar="YYYY-MM-DD",
            help="Start date, for tracks with times of day only; adds times to the KML lines.",
            parser=parse_date,
            show_default=False,
        ),
    ] = None,
    tentative: Annotated[
        bool, typer.Option("--tentative", help="Include tracks that were never confirmed.")
    ] = False,
) -> None:
    """Export tracks."""
    from multiradar.report.kml import kml as kml_of
    from multiradar.report.track_lines import geojson as geojson_of
    from multiradar.storage.output_file import new_file

    if geojson is None and kml is None:
        raise typer.BadParameter("missing output: --geojson FILE or --kml FILE")
    with ExitStack() as held:
        files = {
            path: held.enter_context(new_file(path)) for path in (geojson, kml) if path is not None
        }
        table = _table(tracks, date, tentative=tentative)
        count = table["track_id"].n_unique()
        for path, parts in (
            (geojson, geojson_of(_lines(table))),
            (kml, kml_of(_lines(table), f"Tracks of {tracks.name}")),
        ):
            if path is not None:
                with files[path].open("w", encoding="utf-8", newline="\n") as file:
                    file.writelines(parts)
    for path in files:
        print(f"{count} tracks with {table.height} positions written to {path}")


def _table(given: Path, date: str | None, *, tentative: bool) -> "pl.DataFrame":
    import polars as pl

    from multiradar.report.times import is_dated

    path = given / _TRACKS_FILE if given.is_dir() else given
    if not path.is_file():
        raise InputError(no_such(given, f"a folder with {_TRACKS_FILE}, or that file itself"))
    try:
        scan = pl.scan_parquet(path)
        found = scan.collect_schema().names()
        missing = [name for name in (*_IDENTITY, *_PLACE, "state") if name not in found]
        if missing:
            raise MissingColumnError(str(path), missing, found, other_table(found, missing))
        table = scan.select(*_IDENTITY, *_PLACE, "state").collect()
    except (pl.exceptions.PolarsError, OSError) as error:
        raise InputError(unreadable(path, "tracks", error)) from error
    if not tentative:
        table = table.filter((pl.col("state") != _TENTATIVE).any().over("track_id"))
    if not table.height:
        msg = f"{path}: no confirmed tracks" + ("" if tentative else "; see --tentative")
        raise InputError(msg)
    if date is not None:
        last = table["time_s"].max()
        if isinstance(last, float) and is_dated(last):
            raise typer.BadParameter(
                "--date applies only to tracks without a date; these tracks already have dates"
            )
        start = dt.datetime.combine(dt.date.fromisoformat(date), dt.time(), dt.UTC)
        table = table.with_columns(pl.col("time_s") + start.timestamp())
    return table.sort("track_id", "time_s", maintain_order=True)


def _lines(table: "pl.DataFrame") -> "Iterator[TrackLine]":
    import numpy as np

    from multiradar.report.track_lines import TrackLine, filled

    for one in table.partition_by("track_id", maintain_order=True):
        # The identity of the last update is the most complete.
        last = one.row(-1, named=True)
        identity = {name: last[name] for name in _IDENTITY}
        time_s, longitude, latitude, height = (
            one[name].fill_null(np.nan).to_numpy() for name in _PLACE
        )
        yield TrackLine(
            name=last["callsign"] or last["mode_s_address"] or _code(last["mode_3a"])
            or f"track {last['track_id']}",
            properties=identity,
            time_s=time_s,
            longitude_deg=longitude,
            latitude_deg=latitude,
            height_m=filled(height),
        )  # fmt: skip


def _code(code: str | None) -> str | None:
    return None if code is None else f"A{code}"
