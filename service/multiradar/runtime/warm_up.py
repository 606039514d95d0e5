"""Loading of the kernels before the first measurement."""

import numpy as np

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.memory.live_tracks import LiveTracks
from multiradar.runtime.queries.encounter_query import EncounterQuery
from multiradar.runtime.queries.encounters import TrackSnapshot, encounters
from multiradar.tracking.forecast.forecast_calibration import calibration_for
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.roster import MISSING
from multiradar.tracking.settings import TrackingSettings


def warm_up(sensors: SensorTable, settings: TrackingSettings) -> None:
    """Compile or load the kernels before the first measurement arrives.

    A separate engine processes plots of an identified and of an unidentified aircraft.
    """
    engine = Engine(sensors, settings)
    number = np.array([1, 1, MISSING, MISSING, 1], np.int64)
    same = np.zeros(len(number))
    engine.push(
        MeasurementBatch(
            time_s=np.array([0.0, 1.0, 2.0, 5.0, 5.25]),
            sensor=np.zeros(len(number), np.int32),
            kind=np.full(len(number), sensors.kinds[0], np.int8),
            range_m=np.where(number == 1, 1e5, 6e4),
            azimuth_rad=same + 1.0,
            latitude_rad=same + np.nanmean(sensors.latitude_rad),
            longitude_rad=same + np.nanmean(sensors.longitude_rad),
            height_m=same + 9000.0,
            mode_3a=np.full(len(number), MISSING, np.int32),
            mode_s_address=np.full(len(number), MISSING, np.int64),
            track_number=number,
            callsign=np.full(len(number), MISSING, np.int64),
        )
    )
    engine.flush()
    states, calibration = engine.tracks(), calibration_for(settings)
    calibration.family.forecast_all(states, np.ones(1))
    no_tracks = TrackSnapshot(0.0, LiveTracks().all(), states)
    encounters(no_tracks, EncounterQuery(), engine.plane, settings, calibration)
    engine.close()
