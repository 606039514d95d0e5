"""A run of measurements: input of the filters, and the track updates that come of it."""

from collections.abc import Collection
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import (
    INNOVATION_COUNT,
    READOUT_GROUND,
    READOUT_HEIGHT,
    READOUT_HEIGHT_VARIANCE,
    READOUT_MODES,
    READOUT_RATE,
    READOUT_UPDATES,
    RESTARTED,
)
from multiradar.estimation.filters.arrays import Model, Result, Rows
from multiradar.estimation.filters.bank import Outcome
from multiradar.estimation.measurement.kinds import KIND_POSITION
from multiradar.estimation.measurement.reported_motion import reported_motion
from multiradar.tracking._identity_kernels import describe, observe
from multiradar.tracking.health.health_records import HealthRecords
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import (
    INNOVATIONS_COUNT,
    STATE_CONFIRMED,
    STATE_TENTATIVE,
    BiasRecords,
    EngineOutput,
    Picture,
    StateSample,
    TrackUpdates,
)
from multiradar.tracking.plausibility.adsb_plausibility import PlausibilityWindow
from multiradar.tracking.roster import RowIdentities

#: Columns of a readout with the position of a track in the plane, and its covariance.
SPREAD = np.array([0, 1, 4, 5, 6])


class Run(NamedTuple):
    """The rows of one release of the reorder buffer, and their results.

    Attributes
    ----------
    batch : MeasurementBatch
        The measurements, without the fields hidden from the tracker.
    codes : (n,) int64
        Their Mode 3/A codes.
    rows : Rows
        The same as input of the filters.
    result : Result
        Results of the filter.
    identities : RowIdentities
        Track and identity of each.
    confirmed : (n,) int64
        Whether the track is confirmed, -1 where the number of updates decides.
    flagged : (n,) int64
        Whether the ADS-B reports of the track are implausible.
    """

    batch: MeasurementBatch
    codes: NDArray[np.int64]
    rows: Rows
    result: Result
    identities: RowIdentities
    confirmed: NDArray[np.int64]
    flagged: NDArray[np.int64]


class ClosedEpoch(NamedTuple):
    """Output at the end of an epoch."""

    biases: BiasRecords
    health: HealthRecords
    samples: tuple[StateSample, ...]

    def added_to(self, output: EngineOutput, pictures: tuple[Picture, ...]) -> EngineOutput:
        """Return an output with that of the end of the epoch, and further pictures."""
        return replace(
            output,
            biases=BiasRecords.concatenate([output.biases, self.biases]),
            health=HealthRecords.concatenate([output.health, self.health]),
            pictures=output.pictures + pictures,
            samples=(*output.samples, *self.samples),
        )


class Described(NamedTuple):
    """The rows of a run that update a track.

    Attributes
    ----------
    updated : (m,) int64
        Row numbers.
    described : (m, 6) float64
        Latitude, longitude, speed, heading, sigma of position and of velocity from
        `tracking._identity_kernels.describe`.
    confirmed : (m,) bool
        Whether the track is confirmed.
    first : int
        Number of the first update.
    """

    updated: NDArray[np.intp]
    described: NDArray[np.float64]
    confirmed: NDArray[np.bool_]
    first: int


def filter_rows(batch: MeasurementBatch, model: Model) -> Rows:
    """Return measurements as input of the filters; they have no slots yet."""
    z = np.empty((len(batch), 2))
    kind, sensor = batch.kind.astype(np.int64), batch.sensor.astype(np.int64)
    observe(
        kind, batch.range_m, batch.azimuth_rad, batch.latitude_rad, batch.longitude_rad,
        model.plane, z,
    )  # fmt: skip
    return Rows(
        slot=np.empty(0, np.int64),
        time=batch.time_s,
        kind=kind,
        sensor=sensor,
        z=z,
        height=batch.height_m,
        seen=sensor,
        ground=batch.ground_status(),
        motion=reported_motion(batch.aircraft_data, batch.height_m),
    )


def describe_run(
    run: Run, plane: NDArray[np.float64], confirm_updates: int, first: int
) -> tuple[Described, NDArray[np.int64]]:
    """Return the rows of a run that update a track, and the outcome of every row.

    Parameters
    ----------
    run : Run
        The rows, and their results.
    plane : (k,) float64
        As in `filters.arrays.Model`.
    confirm_updates : int
        Number of updates that confirm a track.
    first : int
        Number of the first update.

    Returns
    -------
    Described
        The rows that update a track.
    (n,) int64
        `Outcome` of each row.
    """
    result = run.result
    accepted = np.flatnonzero(result.outcome <= RESTARTED)
    described = np.empty((len(accepted), 6))
    describe(accepted, result.readout, plane, described)
    # An estimate beyond the edge of the system plane has no latitude: it is not published.
    located = np.isfinite(described).all(axis=1)
    outcomes = result.outcome.copy()
    outcomes[accepted[~located]] = Outcome.UNLOCATABLE
    accepted, described = accepted[located], described[located]
    confirmed = result.readout[accepted, READOUT_UPDATES] >= confirm_updates
    decided = run.confirmed[accepted]
    confirmed = np.where(decided < 0, confirmed, decided > 0)
    return Described(accepted, described, confirmed, first), outcomes


def track_updates(
    shown: MeasurementBatch,
    run: Run,
    accepted: Described,
    hidden_fields: Collection[str],
    *,
    keeps_modes: bool,
) -> TrackUpdates:
    """Return the updates of a run.

    Parameters
    ----------
    shown : MeasurementBatch
        The measurements as received.
    run : Run
        The same without hidden fields, and their results.
    accepted : Described
        The rows that update a track.
    hidden_fields : collection of str
        Fields published as measured, because they are hidden from the tracker.
    keeps_modes : bool
        Whether the filter has modes of motion.

    Returns
    -------
    TrackUpdates
        One row for each row of `accepted`.
    """
    batch, result, identities = run.batch, run.result, run.identities
    updated, described, confirmed, first = accepted
    height_m = result.readout[updated, READOUT_HEIGHT]
    modes = result.readout[updated, READOUT_MODES : READOUT_MODES + 3]
    if not keeps_modes:
        modes = np.full_like(modes, np.nan)
    known = {
        name: getattr(shown if name in hidden_fields else identities, name)
        for name in ("track_number", "mode_s_address", "mode_3a", "callsign")
    }
    return TrackUpdates(
        sequence=np.arange(first, first + len(updated), dtype=np.int64),
        time_s=batch.time_s[updated],
        track_id=identities.track_id[updated],
        sensor=batch.sensor[updated],
        track_number=known["track_number"][updated],
        mode_s_address=known["mode_s_address"][updated],
        mode_3a=known["mode_3a"][updated].astype(np.int32),
        latitude_rad=described[:, 0],
        longitude_rad=described[:, 1],
        height_m=height_m,
        speed_mps=described[:, 2],
        heading_rad=described[:, 3],
        position_sigma_m=described[:, 4],
        velocity_sigma_mps=described[:, 5],
        state=np.where(confirmed, STATE_CONFIRMED, STATE_TENTATIVE).astype(np.int8),
        turn_right_probability=modes[:, 0],
        turn_left_probability=modes[:, 1],
        speed_change_probability=modes[:, 2],
        vertical_rate_mps=result.readout[updated, READOUT_RATE],
        height_sigma_m=np.where(
            np.isnan(height_m), np.nan, np.sqrt(result.readout[updated, READOUT_HEIGHT_VARIANCE])
        ),
        adsb_implausible=run.flagged[updated] != 0,
        callsign=known["callsign"][updated],
        measured_mode_s_address=shown.mode_s_address[updated],
        on_ground=result.readout[updated, READOUT_GROUND].astype(np.int8),
    )


def update_innovations(
    run: Run, updated: NDArray[np.intp], noises: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the innovations of the measurements that updated a track.

    Parameters
    ----------
    run : Run
        The rows of the run, and their results.
    updated : (m,) int64
        Row numbers.
    noises : (k, 4) float64
        As in `filters.arrays.Model`, with those of single measurements.

    Returns
    -------
    (m, INNOVATIONS_COUNT) float64
        As in `EngineOutput.innovations`.
    """
    found = np.empty((len(updated), INNOVATIONS_COUNT))
    found[:, :INNOVATION_COUNT] = run.result.innovation[updated]
    variances = noises[run.rows.seen[updated]]
    reported = (run.rows.kind[updated] == KIND_POSITION)[:, None]
    found[:, INNOVATION_COUNT:] = np.where(reported, variances[:, 2:3], variances[:, :2])
    return found


def plausibility_window(run: Run, first: int, last: int) -> PlausibilityWindow:
    """Return rows of a run for the check of their plausibility."""
    return PlausibilityWindow(
        run.rows, run.identities, run.batch.mode_s_address, run.flagged, first, last
    )
