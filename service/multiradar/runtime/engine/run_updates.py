"""What a run of measurements said of tracks, as rows of their updates."""

from collections.abc import Collection
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import (
    READOUT_HEIGHT,
    READOUT_HEIGHT_VARIANCE,
    READOUT_MODES,
    READOUT_RATE,
)
from multiradar.estimation.filters.arrays import Result, Rows
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import STATE_CONFIRMED, STATE_TENTATIVE, TrackUpdates
from multiradar.tracking.roster import RowIdentities


class Run(NamedTuple):
    """The rows of one release, and what is found out about them.

    Attributes
    ----------
    batch : MeasurementBatch
        The measurements, without what is hidden from the tracker.
    codes : (n,) int64
        Their Mode 3/A codes.
    rows : Rows
        The same as the filters take them.
    result : Result
        What the filter made of them.
    identities : RowIdentities
        Whose they are.
    confirmed : (n,) int64
        Whether the track is confirmed, -1 where its number of updates decides.
    flagged : (n,) int64
        Whether the reports of the aircraft are implausible.
    """

    batch: MeasurementBatch
    codes: NDArray[np.int64]
    rows: Rows
    result: Result
    identities: RowIdentities
    confirmed: NDArray[np.int64]
    flagged: NDArray[np.int64]


class Described(NamedTuple):
    """The rows of a run that are told of.

    Attributes
    ----------
    taken : (m,) int64
        Which rows.
    described : (m, 6) float64
        Latitude, longitude, speed, heading, sigma of position and of velocity, as
        `tracking._kernels.describe` gives them.
    confirmed : (m,) bool
        Whether the track is confirmed.
    first : int
        Number of the first update.
    """

    taken: NDArray[np.intp]
    described: NDArray[np.float64]
    confirmed: NDArray[np.bool_]
    first: int


def track_updates(
    shown: MeasurementBatch,
    run: Run,
    told: Described,
    hidden_fields: Collection[str],
    *,
    keeps_modes: bool,
) -> TrackUpdates:
    """Return the updates of a run.

    Parameters
    ----------
    shown : MeasurementBatch
        The measurements as they came.
    run : Run
        The same without what is hidden, and what became of them.
    told : Described
        The rows that are told of.
    hidden_fields : collection of str
        What is told as it was measured, since the tracker did not see it.
    keeps_modes : bool
        Whether the filter has modes of motion.

    Returns
    -------
    TrackUpdates
        One row for each row that is told of.
    """
    batch, result, identities = run.batch, run.result, run.identities
    taken, described, confirmed, first = told
    height_m = result.readout[taken, READOUT_HEIGHT]
    chances = result.readout[taken, READOUT_MODES : READOUT_MODES + 3]
    if not keeps_modes:
        chances = np.full_like(chances, np.nan)
    known = {
        name: getattr(shown if name in hidden_fields else identities, name)
        for name in ("track_number", "mode_s_address", "mode_3a", "callsign")
    }
    return TrackUpdates(
        sequence=np.arange(first, first + len(taken), dtype=np.int64),
        time_s=batch.time_s[taken],
        track_id=identities.track_id[taken],
        sensor=batch.sensor[taken],
        track_number=known["track_number"][taken],
        mode_s_address=known["mode_s_address"][taken],
        mode_3a=known["mode_3a"][taken].astype(np.int32),
        latitude_rad=described[:, 0],
        longitude_rad=described[:, 1],
        height_m=height_m,
        speed_mps=described[:, 2],
        heading_rad=described[:, 3],
        position_sigma_m=described[:, 4],
        velocity_sigma_mps=described[:, 5],
        state=np.where(confirmed, STATE_CONFIRMED, STATE_TENTATIVE).astype(np.int8),
        turn_right_probability=chances[:, 0],
        turn_left_probability=chances[:, 1],
        speed_change_probability=chances[:, 2],
        vertical_rate_mps=result.readout[taken, READOUT_RATE],
        height_sigma_m=np.where(
            np.isnan(height_m), np.nan, np.sqrt(result.readout[taken, READOUT_HEIGHT_VARIANCE])
        ),
        adsb_implausible=run.flagged[taken] != 0,
        callsign=known["callsign"][taken],
    )
