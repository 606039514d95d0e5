"""Encounters of a recording: a table with those at the end of each epoch."""

from itertools import islice
from math import floor

import numpy as np
import polars as pl

from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.memory.live_tracks import LiveTracks
from multiradar.runtime.queries.encounter_query import EncounterQuery
from multiradar.runtime.queries.encounters import TrackSnapshot, encounters
from multiradar.tracking.columns import rows_of
from multiradar.tracking.forecast.forecast_calibration import calibration_for
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.settings import TrackingSettings
from multiradar_schemas.products.encounter import ENCOUNTER_SCHEMA


class EncounterTable:
    """A table by epoch: the answer of the service after the last measurement of each.

    Parameters
    ----------
    query : EncounterQuery
        Selection of encounters.
    plane : SystemPlane
        The plane of the states.
    settings : TrackingSettings
        Settings of the tracker.
    """

    def __init__(
        self, query: EncounterQuery, plane: SystemPlane, settings: TrackingSettings
    ) -> None:
        self._query, self._plane, self._settings = query, plane, settings
        self._calibration = calibration_for(settings)
        self._live = LiveTracks()
        # Pairs not compared because too many tracks were close together.
        self._pairs_left_out = 0

    def update(self, output: EngineOutput) -> pl.DataFrame:
        """Return the rows of the epochs completed by an output of the engine."""
        rows = rows_of(output.updates)
        found, done, learnt = [], 0, 0
        parts = self._calibration.parts(output)
        for picture in output.pictures:
            until = int(np.searchsorted(rows["time_s"], picture.time_s, side="right"))
            self._live.update(rows[done:until])
            done = max(done, until)
            epoch = floor(picture.time_s / self._settings.epoch_s)
            due = sum(sample.epoch <= epoch for sample in output.samples)
            # The calibration uses the samples up to that epoch only.
            for _ in islice(parts, due - learnt):
                learnt += 1
            snapshot = TrackSnapshot(picture.time_s, self._live.all(), picture.states)
            answer = encounters(
                snapshot, self._query, self._plane, self._settings, self._calibration
            )
            self._pairs_left_out += answer["pairs_left_out"]
            found += answer["encounters"]
        for _ in parts:
            continue
        self._live.update(rows[done:])
        self._live.remove(output.ended.track_id)
        return pl.DataFrame(found, schema=ENCOUNTER_SCHEMA)

    def finish(self) -> pl.DataFrame:
        """Return the remaining rows: none, since the end of the stream completes its epoch."""
        return pl.DataFrame(schema=ENCOUNTER_SCHEMA)

    def warnings(self) -> list[str]:
        """Return a warning if encounters may be missing."""
        if not self._pairs_left_out:
            return []
        return [
            f"encounters may be missing: {self._pairs_left_out} pairs were not compared because "
            "too many tracks were close together"
        ]
