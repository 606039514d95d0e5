"""Encounters of a recording: a table with those of the end of each epoch."""

from itertools import islice
from math import floor

import numpy as np
import polars as pl

from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.memory.live_tracks import LiveTracks
from multiradar.runtime.queries.encounter_query import EncounterQuery
from multiradar.runtime.queries.encounters import Sky, encounters
from multiradar.tracking.columns import rows_of
from multiradar.tracking.forecast.forecast_calibration import calibration_for
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.settings import TrackingSettings
from multiradar_schemas.products.encounter import ENCOUNTER_SCHEMA


class EncounterTable:
    """A table by epoch: what the service would answer after the last measurement of each.

    Parameters
    ----------
    query : EncounterQuery
        Which encounters; all that are found.
    plane : SystemPlane
        The plane of the states.
    settings : TrackingSettings
        How aircraft are taken to move.
    """

    def __init__(
        self, query: EncounterQuery, plane: SystemPlane, settings: TrackingSettings
    ) -> None:
        self._query, self._plane, self._settings = query, plane, settings
        self._calibration = calibration_for(settings)
        self._live = LiveTracks()
        # Comparisons that were left out because too many tracks were in one place.
        self._pairs_left_out = 0

    def take(self, output: EngineOutput) -> pl.DataFrame:
        """Return the rows of the epochs that an output of the engine ends."""
        rows = rows_of(output.updates)
        found, done, learnt = [], 0, 0
        parts = self._calibration.parts(output)
        for picture in output.pictures:
            until = int(np.searchsorted(rows["time_s"], picture.time_s, side="right"))
            self._live.update(rows[done:until])
            done = max(done, until)
            epoch = floor(picture.time_s / self._settings.epoch_s)
            lessons = sum(sample.epoch <= epoch for sample in output.samples)
            # What the samples until then teach, and no more, is what was known then.
            for _ in islice(parts, lessons - learnt):
                learnt += 1
            sky = Sky(picture.time_s, self._live.all(), picture.states)
            answer = encounters(sky, self._query, self._plane, self._settings, self._calibration)
            self._pairs_left_out += answer["pairs_left_out"]
            found += answer["encounters"]
        for _ in parts:
            continue
        self._live.update(rows[done:])
        self._live.end(output.ended.track_id)
        return pl.DataFrame(found, schema=ENCOUNTER_SCHEMA)

    def finish(self) -> pl.DataFrame:
        """Return the rows that are left: none, the end of the stream has ended its epoch."""
        return pl.DataFrame(schema=ENCOUNTER_SCHEMA)

    def warnings(self) -> list[str]:
        """Return what the reader should know: whether encounters may be missing."""
        if not self._pairs_left_out:
            return []
        return [
            f"encounters may be missing: {self._pairs_left_out} comparisons were left out because "
            "too many tracks were in one place"
        ]
