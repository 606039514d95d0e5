"""The requested tables of an offline run, by epochs of data time."""

from pathlib import Path
from typing import Protocol

import polars as pl

from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.offline.bundle_forecast_table import BundleForecasts, BundleForecastTable
from multiradar.runtime.offline.delay_table import DelayTable
from multiradar.runtime.offline.encounter_table import EncounterTable
from multiradar.runtime.offline.forecast_table import ForecastTable
from multiradar.runtime.offline.offline_job import (
    BUNDLE_FORECASTS_FILE,
    DELAYS_FILE,
    ENCOUNTERS_FILE,
    FORECASTS_FILE,
    OBSERVABILITY_FILE,
    PLANES_FILE,
    TRAJECTORIES_FILE,
    OfflineJob,
)
from multiradar.runtime.offline.trajectory_table import TrajectoryTable
from multiradar.runtime.queries.manoeuvre_planes import plane_of_track
from multiradar.runtime.queries.observabilities import observability_of_track
from multiradar.runtime.queries.track_windows import WindowAnalysis, WindowTable
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


def requested_tables(
    job: OfflineJob, folder: Path, plane: SystemPlane
) -> dict[str, tuple[Table, TableWriter]]:
    """Return the requested tables by epoch, each with its writer, by file."""
    kinds: tuple[tuple[str, float | None, WindowAnalysis, pl.Schema], ...] = (
        (PLANES_FILE, job.plane_window_s, plane_of_track, MANOEUVRE_PLANE_SCHEMA),
        (
            OBSERVABILITY_FILE, job.observability_window_s, observability_of_track,
            OBSERVABILITY_SCHEMA,
        ),
    )  # fmt: skip
    tables: dict[str, tuple[Table, TableWriter]] = {
        file: (
            WindowTable(analyse, schema, job.sensors, window_s, job.settings.epoch_s),
            TableWriter(folder / file, schema),
        )
        for file, window_s, analyse, schema in kinds
        if window_s is not None
    }
    if job.sensors.delayed.any():
        tables[DELAYS_FILE] = (
            DelayTable(job.sensors),
            TableWriter(folder / DELAYS_FILE, AIRCRAFT_DELAY_SCHEMA),
        )
    if job.encounters is not None:
        tables[ENCOUNTERS_FILE] = (
            EncounterTable(job.encounters, plane, job.settings),
            TableWriter(folder / ENCOUNTERS_FILE, ENCOUNTER_SCHEMA),
        )
    if job.trajectories is not None:
        every_s = job.forecasts_every_s
        forecasts = None if every_s is None else BundleForecasts(every_s)
        bundles = TrajectoryTable(job.trajectories, job.sensors, job.settings, forecasts)
        tables[TRAJECTORIES_FILE] = (
            bundles,
            TableWriter(folder / TRAJECTORIES_FILE, TRAJECTORY_SCHEMA),
        )
        if forecasts is not None:
            tables[BUNDLE_FORECASTS_FILE] = (
                BundleForecastTable(bundles),
                TableWriter(folder / BUNDLE_FORECASTS_FILE, FORECAST_SCHEMA),
            )
    if job.forecasts_every_s is not None:
        tables[FORECASTS_FILE] = (
            ForecastTable(job.sensors, job.settings, plane, job.forecasts_every_s),
            TableWriter(folder / FORECASTS_FILE, FORECAST_SCHEMA),
        )
    return tables
