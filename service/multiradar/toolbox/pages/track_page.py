"""The HTML report of a run of `track`: map, counts and health, without a reference."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.wgs84 import geodetic_to_ecef
from multiradar.report.cells import estimate_texts
from multiradar.report.content import Document, Plot, Series, Table, Value
from multiradar.report.page import report_page
from multiradar.report.times import axis_label, time_text
from multiradar.toolbox.pages.maps import MapPlane, broken_lines, map_plot, site_rings
from multiradar.toolbox.pages.parameters import parameter_words
from multiradar_schemas.report import Report

#: Positions on the map, over all tracks.
_POSITIONS_MAX = 15_000
#: Points of lines by time.
_STEPS = 240
_TENTATIVE = "tentative"
#: What the page needs of `tracks.parquet`: the table of a long run is larger than the memory.
_COLUMNS = (
    "track_id", "sequence", "time_s", "sensor_id", "state", "latitude_deg", "longitude_deg",
    "mode_s_address", "height_m",
)  # fmt: skip
#: A bias whose sigma is still this fraction of that of the prior has no history.
_PRIOR_RATIO_MAX = 0.99
#: Radars with plots of their own.
_SENSORS_MAX = 12


@dataclass(frozen=True, slots=True)
class TrackRun:
    """What a run of `track` wrote.

    Attributes
    ----------
    folder : Path
        With `tracks.parquet`, `biases.parquet` and `health.parquet`.
    report : Report
        Its report.
    sensors : SensorTable
        The sensors.
    name, command : str
        Name of the recording, and the command line.
    """

    folder: Path
    report: Report
    sensors: SensorTable
    name: str
    command: str


def track_page(run: TrackRun) -> str:
    """Return the report of a run as one HTML page."""
    tracks = pl.scan_parquet(run.folder / "tracks.parquet").select(_COLUMNS).collect()
    confirmed = confirmed_tracks(tracks)
    counts, figures = run.report.counts, _figures(run)
    alarms = len(figures["sensor_alarms"])
    document = Document(
        title=f"Tracking run: {run.name}",
        summary=(
            f"{figures['tracks_confirmed']:,} confirmed tracks ({figures['tracks']:,} initiated) "
            f"from {counts.read:,} measurements with filter "
            f"{run.report.settings['filter_name']}: accepted {counts.accepted:,}, rejected "
            f"{counts.rejected:,}, duplicate {counts.duplicate:,}. "
            f"{alarms or 'No'} radar alarm{'' if alarms == 1 else 's'}."
        ),
        command=run.command,
        tables=[one for one in _tables(run, tracks, confirmed) if one.rows],
        plots=list(_plots(run, confirmed)),
        notes=_notes(run),
    )
    return report_page(document)


def confirmed_tracks(tracks: pl.DataFrame) -> pl.DataFrame:
    """Return the updates of tracks that were confirmed."""
    return tracks.filter((pl.col("state") != _TENTATIVE).any().over("track_id"))


def _figures(run: TrackRun) -> dict[str, Any]:
    return dict(run.report.figures)


def _tables(run: TrackRun, tracks: pl.DataFrame, confirmed: pl.DataFrame) -> Iterator[Table]:
    yield _health(run)
    yield _biases(run)
    yield _sensors(run, tracks)
    yield _tracks(run, confirmed)
    yield _measurements(run)


def _health(run: TrackRun) -> Table:
    rows = tuple(
        (
            name, _shown(row["detection_probability"], ".1%"), _shown(row["range_sigma_ratio"]),
            _shown(row["azimuth_sigma_ratio"]), _shown(row["silence_s"], ".1f"),
            str(row["alarms"]).replace(",", ", ").replace("_", " ") or "none",
        )
        for name, row in _figures(run)["sensor_health"].items()
    )  # fmt: skip
    return Table(
        title="Final radar health",
        header=(
            "radar", "Pd", "range noise / configured", "azimuth noise / configured",
            "time since last plot, s", "alarms",
        ),
        rows=rows,
        caption="Pd: probability that an aircraft in coverage is detected in a scan.",
    )  # fmt: skip


def _shown(value: object, form: str = ".2f") -> Value:
    return f"{value:{form}}" if isinstance(value, float) else None


def _biases(run: TrackRun) -> Table:
    rows = tuple(
        (
            sensor, "".join(parameter_words(parameter)),
            *(text.replace("-", "−") for text in estimate_texts(one["estimate"], one["sigma"])),
            f"{one['prior_ratio']:.1%}",
        )
        for sensor, parameters in _figures(run)["final_biases"].items()
        for parameter, one in parameters.items()
    )  # fmt: skip
    return Table(
        title="Final bias estimates",
        header=("sensor", "bias", "estimate", "sigma", "sigma / prior sigma"),
        rows=rows,
        caption="Measured minus true.",
    )


def _sensors(run: TrackRun, tracks: pl.DataFrame) -> Table:
    received = _figures(run)["arrivals"]
    used = tracks.group_by("sensor_id").agg(
        pl.len(), pl.col("track_id").n_unique().alias("tracks"),
        pl.col("time_s").min().alias("first"), pl.col("time_s").max().alias("last"),
    )  # fmt: skip
    found = {row["sensor_id"]: row for row in used.iter_rows(named=True)}
    rows: list[tuple[Value, ...]] = []
    for name in run.sensors.ids:
        row = found.get(name)
        if row is None:
            rows.append((name, _received(received, name), 0, 0, None, None))
            continue
        times = time_text(row["first"]), time_text(row["last"])
        rows.append((name, _received(received, name), row["len"], row["tracks"], *times))
    return Table(
        title="Sensors",
        header=("sensor", "received", "track updates", "tracks", "first", "last"),
        rows=tuple(rows),
    )


def _received(arrivals: dict[str, Any], name: str) -> Value:
    counts = arrivals.get(name, {}).get("received")
    return counts if isinstance(counts, int) else None


def _tracks(run: TrackRun, confirmed: pl.DataFrame) -> Table:
    lives = confirmed.group_by("track_id").agg(
        (pl.col("time_s").max() - pl.col("time_s").min()).alias("life_s"), pl.len().alias("n")
    )
    rows: list[tuple[Value, ...]] = [
        ("confirmed", f"{lives.height:,}"),
        ("initiated", f"{_figures(run)['tracks']:,}"),
    ]
    rows += [(name.replace("_", " "), f"{count:,}")
             for name, count in _figures(run)["track_transitions"].items()
             if name not in {"started", "confirmed"}]  # fmt: skip
    if lives.height:
        rows += [
            (
                "median lifetime of a confirmed track, s",
                f"{np.median(lives['life_s'].to_numpy()):.0f}",
            ),
            (
                "median number of updates of a confirmed track",
                f"{np.median(lives['n'].to_numpy()):.0f}",
            ),
            ("updates with a Mode S address", f"{_fraction(confirmed, 'mode_s_address'):.1%}"),
            ("updates with a height", f"{_fraction(confirmed, 'height_m'):.1%}"),
        ]
    return Table(title="Tracks", header=("quantity", "value"), rows=tuple(rows))


def _fraction(table: pl.DataFrame, column: str) -> float:
    return 1.0 - table[column].null_count() / max(table.height, 1)


def _measurements(run: TrackRun) -> Table:
    counts = run.report.counts
    rows: list[tuple[Value, ...]] = [
        ("read", f"{counts.read:,}"), ("accepted", f"{counts.accepted:,}"),
        ("duplicate", f"{counts.duplicate:,}"), ("rejected", f"{counts.rejected:,}"),
    ]  # fmt: skip
    rows += [(f"rejected: {code}", f"{n:,}") for code, n in run.report.rejected_by_code.items()]
    rows += [
        (f"accepted: {name.replace('_', ' ')}", f"{n:,}")
        for name, n in _figures(run)["measurements_by_outcome"].items()
        if n
    ]
    return Table(title="Measurements", header=("disposition", "measurements"), rows=tuple(rows))


def _notes(run: TrackRun) -> list[str]:
    figures = _figures(run)
    notes = [
        f"Alarm for {one['sensor_id']}: {str(one['alarm']).replace('_', ' ')} at "
        f"{time_text(one['time_s'])}."
        for one in figures["sensor_alarms"]
    ]
    notes += [f"{one['sentence']}." for one in figures["diagnoses"] if one.get("sentence")]
    notes += [f"{one[:1].upper()}{one[1:]}." for one in figures["warnings"]]
    notes += [
        f"Not observable: {one['what']} (sigma still {one['prior_ratio']:.0%} of the prior)."
        for one in figures["unobservable_biases"]
    ]
    return [*notes, f"Output digest: {run.report.output_sha256}."]


def _plots(run: TrackRun, confirmed: pl.DataFrame) -> Iterator[Plot]:
    if not confirmed.height:
        return
    yield tracks_map(run.sensors, confirmed)
    yield _live(confirmed)
    yield from _histories(run)


def tracks_map(table: SensorTable, confirmed: pl.DataFrame) -> Plot:
    """Return a map of tracks and the sites of sensors.

    Parameters
    ----------
    table : SensorTable
        The sensors.
    confirmed : DataFrame
        Updates of confirmed tracks.

    Returns
    -------
    Plot
        On a plane through their middle.
    """
    every = -(-confirmed.height // _POSITIONS_MAX)
    # The last position of a track stays on the map.
    thinned = confirmed.sort("track_id", "sequence").filter(
        (pl.int_range(pl.len()).over("track_id") % every == 0)
        | (pl.int_range(pl.len()).over("track_id") == pl.len().over("track_id") - 1)
    )
    latitude, longitude = (
        np.radians(thinned[name].to_numpy()) for name in ("latitude_deg", "longitude_deg")
    )
    # On the ellipsoid: a map shows the foot of each position.
    positions = geodetic_to_ecef(latitude, longitude, np.zeros(len(latitude)))
    plane = MapPlane.around(positions)
    local = plane.kilometres(positions)
    starts = np.flatnonzero(np.diff(thinned["track_id"].to_numpy(), prepend=-1))
    x, y = broken_lines(np.split(local, starts[1:]))
    sites = {
        name: (float(table.latitude_rad[row]), float(table.longitude_rad[row]), 0.0)
        for row, name in enumerate(table.ids)
        if np.isfinite(table.latitude_rad[row])
    }
    series = [
        Series("confirmed tracks", x, y, "thin", key="tracks"),
        *site_rings(plane, sites, "ink"),
    ]
    return map_plot(
        "Map of tracks",
        series,
        f"Confirmed tracks on the tangent plane at {plane.place}; rings mark the sensor sites.",
    )


def _live(confirmed: pl.DataFrame) -> Plot:
    time_s = confirmed["time_s"].to_numpy()
    first, last = float(time_s.min()), float(time_s.max())
    edges = np.linspace(first, max(last, first + 1.0), _STEPS)
    lives = confirmed.group_by("track_id").agg(
        pl.col("time_s").min().alias("first"), pl.col("time_s").max().alias("last")
    )
    initiated = np.searchsorted(np.sort(lives["first"].to_numpy()), edges, side="right")
    ended = np.searchsorted(np.sort(lives["last"].to_numpy()), edges, side="left")
    return Plot(
        title="Live tracks over time",
        x_label=axis_label([first, last]),
        y_label="confirmed tracks",
        series=(Series("", edges, (initiated - ended).astype(np.float64), "line", key="tracks"),),
        x_scale="time",
        caption="Each track is counted from its first to its last update.",
        name="live-tracks",
    )


def _histories(run: TrackRun) -> Iterator[Plot]:
    biases = pl.read_parquet(run.folder / "biases.parquet").sort("time_s")
    for parameter in biases["parameter"].unique(maintain_order=True).to_list():
        own = biases.filter(pl.col("parameter") == parameter)
        name, unit = parameter_words(parameter)
        for sensor in own["sensor_id"].unique().sort().to_list()[:_SENSORS_MAX]:
            rows = own.filter(pl.col("sensor_id") == sensor)
            ratio = _figures(run)["final_biases"][sensor][parameter]["prior_ratio"]
            if ratio > _PRIOR_RATIO_MAX:
                continue
            time_s, estimate, sigma = (
                rows[name].to_numpy() for name in ("time_s", "estimate", "sigma")
            )
            last = float(estimate[-1])
            apart, first = estimate - last, float(time_s[0])
            # Shown when settled: the first estimates are the priors.
            high = 4.0 * float(np.median(sigma)) + float(np.quantile(np.abs(apart), 0.8))
            yield Plot(
                title=sensor,
                x_label=axis_label([first, float(time_s[-1])]),
                y_label=f"{name} minus its final estimate{unit}",
                series=(
                    Series("± sigma", time_s, apart - sigma, "band", apart + sigma, "bias"),
                    Series("estimate", time_s, apart, "line", key="bias"),
                ),
                x_scale="time",
                y_limits=(-high, high),
                caption=f"Final estimate: {last:.4g}{unit.lstrip(',')}.".replace("-", "−"),
                group=f"{name.capitalize()} over time",
                name=f"{parameter}-{sensor}",
            )
