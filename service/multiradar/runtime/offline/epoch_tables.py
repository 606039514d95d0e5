"""The requested tables of an offline run, by epochs of data time."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple, Protocol

import polars as pl

from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.offline.delay_table import DelayTable
from multiradar.runtime.offline.offline_job import (
    BUNDLE_FORECASTS_FILE,
    DELAYS_FILE,
    ENCOUNTERS_FILE,
    FORECASTS_FILE,
    OBSERVABILITY_FILE,
    PLANES_FILE,
    TRAJECTORIES_FILE,
    OfflineJob,
    OfflineResult,
)
from multiradar.runtime.queries.track_windows import WindowAnalysis, WindowTable
from multiradar.runtime.trajectories.options import TrajectoryOptions
from multiradar.storage.table_writer import TableWriter
from multiradar.tracking.outputs import EngineOutput
from multiradar_schemas.products.aircraft_delay import AIRCRAFT_DELAY_SCHEMA
from multiradar_schemas.products.encounter import ENCOUNTER_SCHEMA
from multiradar_schemas.products.forecast import FORECAST_SCHEMA
from multiradar_schemas.products.manoeuvre_plane import MANOEUVRE_PLANE_SCHEMA
from multiradar_schemas.products.observability import OBSERVABILITY_SCHEMA
from multiradar_schemas.products.trajectories import TRAJECTORY_SCHEMA


class Table(Protocol):
    """A table by epochs of data time."""

    def update(self, output: EngineOutput) -> pl.DataFrame:
        """Return the rows that the output of one call completes."""
        ...

    def finish(self) -> pl.DataFrame:
        """Return the remaining rows."""
        ...


class RequestedTable(NamedTuple):
    """A table and its file.

    Attributes
    ----------
    table : Table
        Computes the rows.
    writer : TableWriter
        Writes them.
    add_figures : callable
        Adds the figures and warnings of the finished table to the result of the run.
    """

    table: Table
    writer: TableWriter
    add_figures: Callable[[OfflineResult], None] = lambda _result: None


def requested_tables(
    job: OfflineJob, folder: Path, plane: SystemPlane
) -> dict[str, RequestedTable]:
    """Return the requested tables by epoch, by file.

    Tables are imported when requested: what they need takes a third of a second, and most runs
    need none.
    """
    tables: dict[str, RequestedTable] = {}

    def window_table(
        file: str, schema: pl.Schema, analyse: WindowAnalysis, window_s: float
    ) -> None:
        table = WindowTable(analyse, schema, job.sensors, window_s, job.settings.epoch_s)
        tables[file] = RequestedTable(table, TableWriter(folder / file, schema))

    if job.plane_window_s is not None:
        from multiradar.runtime.queries.manoeuvre_planes import plane_of_track

        window_table(PLANES_FILE, MANOEUVRE_PLANE_SCHEMA, plane_of_track, job.plane_window_s)
    if job.observability_window_s is not None:
        from multiradar.runtime.queries.observabilities import observability_of_track

        window_table(
            OBSERVABILITY_FILE, OBSERVABILITY_SCHEMA, observability_of_track,
            job.observability_window_s,
        )  # fmt: skip
    if job.sensors.delayed.any():
        delays = DelayTable(job.sensors)
        tables[DELAYS_FILE] = RequestedTable(
            delays,
            TableWriter(folder / DELAYS_FILE, AIRCRAFT_DELAY_SCHEMA),
            lambda result: result.delays.update(delays.figures()),
        )
    if job.encounters is not None:
        from multiradar.runtime.offline.encounter_table import EncounterTable

        encounters = EncounterTable(job.encounters, plane, job.settings)
        tables[ENCOUNTERS_FILE] = RequestedTable(
            encounters,
            TableWriter(folder / ENCOUNTERS_FILE, ENCOUNTER_SCHEMA),
            lambda result: result.warnings.extend(encounters.warnings()),
        )
    if job.trajectories is not None:
        tables |= _bundle_tables(job, job.trajectories, folder)
    if job.forecasts_every_s is not None:
        from multiradar.runtime.offline.forecast_table import ForecastTable

        tables[FORECASTS_FILE] = RequestedTable(
            ForecastTable(job.sensors, job.settings, plane, job.forecasts_every_s),
            TableWriter(folder / FORECASTS_FILE, FORECAST_SCHEMA),
        )
    return tables


def _bundle_tables(
    job: OfflineJob, options: TrajectoryOptions, folder: Path
) -> dict[str, RequestedTable]:
    from multiradar.runtime.offline.bundle_forecast_table import (
        BundleForecasts,
        BundleForecastTable,
    )
    from multiradar.runtime.offline.trajectory_table import TrajectoryTable

    every_s = job.forecasts_every_s
    forecasts = None if every_s is None else BundleForecasts(every_s)
    bundles = TrajectoryTable(options, job.sensors, job.settings, forecasts)
    tables = {
        TRAJECTORIES_FILE: RequestedTable(
            bundles,
            TableWriter(folder / TRAJECTORIES_FILE, TRAJECTORY_SCHEMA),
            lambda result: result.trajectories.update(bundles.counts()),
        )
    }
    if forecasts is not None:
        tables[BUNDLE_FORECASTS_FILE] = RequestedTable(
            BundleForecastTable(bundles),
            TableWriter(folder / BUNDLE_FORECASTS_FILE, FORECAST_SCHEMA),
        )
    return tables
