"""The estimation engine: measurements in, track updates and biases out, by epochs of data time.

During an epoch every track uses the biases published at the end of the previous epoch. The bias
information of the measurements of an epoch is merged, partition by partition, when it closes. The
output depends only on the sequence of measurements, not on batches, workers or wall-clock time.
"""

import itertools
import math
from collections import Counter
from dataclasses import replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.bias.observability import UnobservableBias
from multiradar.estimation.bias.store import BiasState
from multiradar.estimation.filters.arrays import Model, Result, Rows, result_arrays
from multiradar.estimation.filters.bank import Outcome
from multiradar.estimation.measurement.plot_rates import plots_per_scan_max
from multiradar.estimation.measurement.sensor_changes import SensorChange
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.engine.prerequisites import plane_for, require_usable
from multiradar.runtime.engine.run_updates import (
    SPREAD,
    ClosedEpoch,
    Run,
    describe_run,
    filter_rows,
    plausibility_window,
    track_updates,
    update_innovations,
)
from multiradar.runtime.engine.shared_biases import SharedBiases
from multiradar.runtime.engine.step_pool import OpenStepPool
from multiradar.runtime.engine.stepper import Stepper
from multiradar.runtime.engine.track_states import sampled, track_states
from multiradar.state import Fields, carry_state
from multiradar.tracking.association.shared_plots import RowSelection, shared_plots
from multiradar.tracking.association.window_association import (
    WINDOW_S,
    Association,
    AssociationWindow,
)
from multiradar.tracking.bearings.bearing_starts import BearingStarts
from multiradar.tracking.bearings.sources import Sources, find_sources
from multiradar.tracking.delays import DelayLog
from multiradar.tracking.forecast.state_samples import Sampling, is_due
from multiradar.tracking.health.health_records import HealthRecords
from multiradar.tracking.health.sensor_health import SensorHealth
from multiradar.tracking.input.duplicates import Duplicates
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.input.near_duplicates import NearDuplicates
from multiradar.tracking.input.order import ReorderBuffer
from multiradar.tracking.lifecycle.transition_log import NOT_UPDATED, TransitionLog, Updated
from multiradar.tracking.lifecycle.transitions import (
    SILENT,
    UNCONFIRMED,
    TerminatedTracks,
    TrackTransitions,
)
from multiradar.tracking.model import bias_columns
from multiradar.tracking.outputs import (
    NO_OUTPUT,
    BiasRecords,
    DelayRecords,
    EndedTracks,
    EngineOutput,
    Picture,
    StateSample,
    TrackPlots,
    TrackStates,
    TrackUpdates,
)
from multiradar.tracking.plausibility.adsb_plausibility import Plausibility
from multiradar.tracking.pool import AircraftPool
from multiradar.tracking.roster import RowIdentities
from multiradar.tracking.settings import TrackingSettings

Floats = NDArray[np.float64]


class Engine:
    """Estimates tracks and biases from admitted measurements; owned by one thread at a time.

    Parameters
    ----------
    sensors : SensorTable
        The sensors and their bias parameters.
    settings : TrackingSettings
        Settings of the tracker.
    workers : int
        Threads that update the tracks, 1 to `WORKERS_MAX`; the output does not depend on it.
    open_steps : callable, optional
        Opens what updates the tracks in place of threads.
    pictures : bool
        Whether the output contains the live tracks at the end of each epoch.
    sampling : Sampling
        Which track states the output contains at ends of epochs.
    plane : SystemPlane, optional
        By default that of the sensors.

    Raises
    ------
    ConfigurationError
        If a setting or prior is invalid.
    UnknownFilterError
        If the filter of the settings does not exist.
    """

    STATE: ClassVar[Fields] = {
        "_order": ReorderBuffer, "_near": NearDuplicates, "_biases": SharedBiases,
        "_plausibility": Plausibility, "_pool": AircraftPool, "_delays": DelayLog,
        "_association": Association, "_bearing_starts": BearingStarts,
        "_transitions": TransitionLog, "_health": SensorHealth, "_sampled": float,
        "_epoch": int | None, "_epoch_open": bool, "_last_s": float, "_steps": int,
        "_sequence": int, "_outcomes": Counter[str],
    }  # fmt: skip

    def __init__(
        self,
        sensors: SensorTable,
        settings: TrackingSettings,
        workers: int = 1,
        *,
        open_steps: OpenStepPool | None = None,
        pictures: bool = False,
        sampling: Sampling = Sampling.NONE,
        plane: SystemPlane | None = None,
    ) -> None:
        self._settings, self._sensors = settings, sensors
        self._sources: Sources | None = None
        self._plane = plane or plane_for(sensors)
        self._filter = require_usable(sensors, settings, self._plane)
        delays = bool(sensors.delayed.any())
        self._order = ReorderBuffer(settings.reorder_horizon_s)
        self._near = NearDuplicates(sensors, settings.hidden_fields)
        self._biases = SharedBiases(sensors, settings, self._filter, self._plane)
        sizes = bias_columns(sensors), len(sensors), len(self._biases.model.modes)
        compared = len(sensors) if Plausibility(sensors).active else 0
        self._pool = AircraftPool(
            self._filter, *sizes, compared=compared, delays=delays,
            tentative_max=plots_per_scan_max(sensors),
        )  # fmt: skip
        self._delays = DelayLog()
        self._shared = shared_plots(settings, self._filter, sizes, delays=delays)
        self._transitions = TransitionLog(settings.coast_after_s)
        self._sampling = sampling
        self._begin_time()
        self._pictures: list[Picture] | None = [] if pictures else None
        self._sequence, self._steps = 0, 1
        self._outcomes: Counter[str] = Counter()
        self._stepper = Stepper(self._filter, self._pool, self._biases, workers, open_steps)

    # What compares times with earlier ones.
    def _begin_time(self) -> None:
        sensors, settings = self._sensors, self._settings
        self._plausibility = Plausibility(sensors)
        self._association = Association(sensors, settings)
        self._bearing_starts = BearingStarts(
            sensors, settings, active=self._filter.accepts_bearings
        )
        self._health = SensorHealth(
            sensors, settings, self._plane, bounds_bias_errors=self._filter.bounds_bias_errors
        )
        self._order.rewind()
        self._near.rewind()
        self._epoch: int | None = None
        self._epoch_open = False
        self._last_s, self._sampled = np.nan, -math.inf

    @property
    def plane(self) -> SystemPlane:
        """The system plane that the states of `tracks` are in."""
        return self._plane

    @property
    def counts(self) -> dict[str, int]:
        """Measurements so far by outcome; also `LATE` and `DUPLICATE`."""
        counts = {outcome.name: self._outcomes[outcome.name] for outcome in Outcome}
        duplicates = self._order.duplicates + self._near.count
        return {**counts, "LATE": self._order.late, "DUPLICATE": duplicates}

    @property
    def waiting_from(self) -> int:
        """Number, by arrival from 0, of the first measurement in the reorder buffer."""
        return self._order.waiting_from

    @property
    def biases(self) -> BiasState:
        """The published biases."""
        return self._biases.state

    def start_from(self, biases: BiasState) -> None:
        """Start from the biases of an earlier run, before the first measurement."""
        self._biases.start_from(biases)

    def push(self, batch: MeasurementBatch, clock_s: float | None = None) -> EngineOutput:
        """Process admitted measurements.

        Parameters
        ----------
        batch : MeasurementBatch
            Rows in order of arrival, in any order of time within the reorder horizon.
        clock_s : float, optional
            The data clock, s, by default the greatest time so far: earlier rows, less the reorder
            horizon, are released.

        Returns
        -------
        EngineOutput
            Of the rows that this releases.
        """
        released = self._order.push(batch, clock_s)
        return NO_OUTPUT if released is None else self._process(released)

    def complete(self) -> EngineOutput:
        """Close the epoch if all its measurements were processed: the next ones need not wait."""
        end_s = math.inf if self._epoch is None else (self._epoch + 1) * self._settings.epoch_s
        if not self._epoch_open or self._order.released_s < end_s:
            return NO_OUTPUT
        return self._close_epoch().added_to(NO_OUTPUT, self._pop_pictures())

    def flush(self) -> EngineOutput:
        """Empty the reorder buffer and close the epoch: the end of a stream.

        Later measurements of the same epoch reopen it. At its end its biases are then published
        once more, with these measurements included.
        """
        released = self._order.flush()
        output = NO_OUTPUT if released is None else self._process(released)
        output = self._close_epoch().added_to(output, self._pop_pictures())
        live = self._pool.used()
        self._record_delays(live, self._pool.roster.track_id[live])
        return replace(output, delays=DelayRecords.concatenate([output.delays, self._delays.pop()]))

    def change_sensors(self, sensors: SensorTable, change: SensorChange) -> EngineOutput:
        """Continue with other sensors, from the next measurements to be processed.

        The epoch is closed, as by `flush`; the reorder buffer is kept. Tracks and their numbers
        continue, and so do the biases and the health of all sensors that are not reset. Raises
        ConfigurationError as the constructor does, and changes nothing then.
        """
        new = Engine(
            sensors, self._settings, pictures=self._pictures is not None,
            sampling=self._sampling, plane=self._plane,
        )  # fmt: skip
        output = self._close_epoch().added_to(NO_OUTPUT, self._pop_pictures())
        self._biases.discard(change, self._pool)
        carry_state(self, new, change)
        new._pool.renumber_sites(new._biases.model.site_numbers)
        self._stepper.renew(new._pool, new._biases)
        vars(self).update(vars(new), _stepper=self._stepper)
        return output

    def restart(self) -> EngineOutput:
        """End the stream, terminate all tracks and accept measurements of earlier times.

        The biases are kept; numbers of tracks and updates continue.
        """
        output = self.flush()
        live = self._pool.used()
        ends = self._pool.terminate(live, np.where(self._confirmed(live), SILENT, UNCONFIRMED))
        ended = self._terminate(0, self._last_s, ends)
        transitions = self._transitions.update(NOT_UPDATED, len(self._pool.roster.track_id))
        self._delays.pop()  # The flush has them.
        self._begin_time()
        return replace(
            output,
            ended=EndedTracks.concatenate([output.ended, ended]),
            transitions=TrackTransitions.concatenate([output.transitions, transitions]),
        )

    def tracks(self) -> TrackStates:
        """Return the live tracks with the uncertainty of the biases included."""
        slots = self._pool.used()
        slots = slots[~np.isnan(self._pool.aircraft.time[slots])]
        return self._states(slots[np.argsort(self._pool.roster.track_id[slots])])

    def unobservable_biases(self) -> tuple[UnobservableBias, ...]:
        """Return the combinations of biases that are not observable so far."""
        return self._biases.unobservable_biases()

    def close(self) -> None:
        """Stop the threads."""
        self._stepper.close()

    @property
    def _model(self) -> Model:
        """The model shared by all tracks, with the sites of the rows being processed."""
        model = self._biases.model
        return model if self._sources is None else self._sources.within(model)

    def _process(self, released: MeasurementBatch) -> EngineOutput:
        shown, near = self._near.filter(released, self._order.arrivals)
        duplicates = Duplicates.concatenate([self._order.dropped, near])
        if len(shown) == 0:
            return replace(NO_OUTPUT, duplicates=duplicates)
        batch = shown.without(self._settings.hidden_fields)
        rows, result, codes = self._prepare(batch)
        identities = RowIdentities.empty(len(batch))
        rows = rows._replace(slot=identities.slot)
        open_, none = np.full(len(batch), -1, np.int64), np.zeros(len(batch), np.int64)
        run = Run(batch, codes, rows, result, identities, confirmed=open_, flagged=none)
        epochs = np.floor(batch.time_s / self._settings.epoch_s).astype(np.int64)
        cuts = [0, *(np.flatnonzero(np.diff(epochs)) + 1).tolist(), len(batch)]
        closed: list[ClosedEpoch] = []
        ended: list[EndedTracks] = []
        for first, last in itertools.pairwise(cuts):
            epoch = int(epochs[first])
            if epoch != self._epoch:
                closed.append(self._close_epoch())
                if self._epoch is None:
                    self._biases.start(epoch * self._settings.epoch_s)
                ended.append(self._open_epoch(epoch, first))
                self._epoch = epoch
            self._epoch_open = True
            for begin, end in self._biases.enter_steps(
                batch.time_s, (first, last), self._steps, self._pool
            ):
                ended += self._process_step(run, begin, end)
            self._last_s = float(batch.time_s[last - 1])
        updates, transitions, accepted, outcomes = self._describe(shown, run)
        noises = (self._biases.model if self._sources is None else self._sources).noises
        return EngineOutput(
            updates=updates,
            biases=BiasRecords.concatenate([one.biases for one in closed]),
            ended=EndedTracks.concatenate(ended),
            transitions=transitions,
            duplicates=duplicates,
            health=HealthRecords.concatenate([one.health for one in closed]),
            plots=TrackPlots(updates.track_id, shown.select(accepted)),
            spread=result.readout[accepted][:, SPREAD],
            innovations=update_innovations(run, accepted, noises),
            pictures=self._pop_pictures(),
            samples=tuple(sample for one in closed for sample in one.samples),
            outcomes=outcomes,
            delays=self._delays.pop(),
            saturated=self._pool.new_tracks.saturated,
            unused=shown.select(np.delete(np.arange(len(shown)), accepted)),
        )

    def _process_step(self, run: Run, first: int, last: int) -> list[EndedTracks]:
        """Process the rows of a step, window by window where association is required."""
        ended = []
        for begin, end, needs_window in self._association.windows(run.batch, first, last):
            window = AssociationWindow(run.batch, run.codes, run.rows, run.identities, begin, end)
            shares = None
            if needs_window:
                start_s = math.floor(run.batch.time_s[begin] / WINDOW_S) * WINDOW_S
                ends = self._association.drop_tracks(start_s, self._model, self._pool)
                ended.append(self._terminate(begin, start_s, ends))
                shares = self._association.associate(window, self._model, self._pool)
                self._plausibility.reassign_reports(
                    plausibility_window(run, begin, end), self._pool
                )
            self._bearing_starts.assign(window, self._model, self._biases.state, self._pool)
            steps = self._plausibility.steps(
                plausibility_window(run, begin, end), self._model, self._biases.state, self._pool
            )
            if shares is None or self._shared is None:
                for start, stop in steps:
                    self._stepper.step(run.rows, run.result, (start, stop), self._model)
            else:
                # Clusters span the whole window: the plausibility of all of it is evaluated first.
                for _ in steps:
                    continue
                selection = RowSelection(np.arange(begin, end), run.rows, run.result)
                left = self._shared.update(shares, selection, self._model, self._pool)
                excluded = self._pool.bias_excluded(run.rows.slot[left])
                self._stepper.step_some(run.rows, run.result, left, excluded, self._model)
            if needs_window:
                self._association.update_lifecycles(window, run.result, self._pool, run.confirmed)
            self._biases.record_sites(run.rows, run.result, self._pool, first=begin, last=end)
            self._health.gather(
                run.rows, run.result, run.identities, run.batch.mode_s_address, self._pool,
                first=begin, last=end,
            )  # fmt: skip
        return ended

    def _prepare(self, batch: MeasurementBatch) -> tuple[Rows, Result, NDArray[np.int64]]:
        rows = filter_rows(batch, self._biases.model)
        rows, self._sources = find_sources(batch, rows, self._biases.model, self._sensors)
        result = result_arrays(
            len(batch), 0, 0, keeps_log=not self._filter.keeps_sensitivity
        )._replace(information=self._biases.information, vector=self._biases.vector)
        return rows, result, batch.mode_3a.astype(np.int64)

    def _describe(
        self, shown: MeasurementBatch, run: Run
    ) -> tuple[TrackUpdates, TrackTransitions, NDArray[np.intp], NDArray[np.int64]]:
        found, outcomes = describe_run(
            run, self._biases.model.plane, self._settings.confirm_updates, self._sequence + 1
        )
        accepted, confirmed = found.updated, found.confirmed
        by_sensor = np.zeros((len(self._sensors), len(Outcome)), np.int64)
        np.add.at(by_sensor, (run.batch.sensor, outcomes), 1)
        self._outcomes.update({one.name: int(by_sensor[:, one].sum()) for one in Outcome})
        self._sequence += len(accepted)
        updated = Updated(
            accepted, run.identities.slot, run.identities.track_id, run.result.outcome,
            run.confirmed, run.batch.time_s, confirmed.astype(np.int64),
        )  # fmt: skip
        transitions = self._transitions.update(updated, len(self._pool.roster.track_id))
        updates = track_updates(
            shown, run, found, self._settings.hidden_fields, keeps_modes=self._filter.keeps_modes
        )
        return updates, transitions, accepted, by_sensor

    def _close_epoch(self) -> ClosedEpoch:
        if self._epoch is None or not self._epoch_open:
            return ClosedEpoch(NO_OUTPUT.biases, NO_OUTPUT.health, ())
        self._epoch_open = False
        self._biases.merge(self._pool)
        end_s = (self._epoch + 1) * self._settings.epoch_s
        health = self._health.close(self._epoch, end_s, self._biases.state, self._pool)
        if health.jumped >= 0:
            self._biases.reset_offsets(health.jumped, self._pool)
        if self._pictures is not None:
            self._pictures.append(Picture(self._last_s, self.tracks()))
        samples = self._samples(self._epoch, end_s)
        return ClosedEpoch(self._biases.records(self._epoch, end_s), health.records, samples)

    def _samples(self, epoch: int, end_s: float) -> tuple[StateSample, ...]:
        # An epoch closed by a flush may close again.
        wanted = self._sampling is not Sampling.NONE and epoch > self._sampled
        if not wanted or not is_due(epoch, self._settings.epoch_s):
            return ()
        self._sampled, confirmed = epoch, self._confirmed(self._pool.used())
        slots = sampled(self._pool, confirmed, epoch, end_s, self._sampling)
        return (StateSample(epoch, end_s, self._states(slots)),)

    def _states(self, slots: NDArray[np.intp]) -> TrackStates:
        return track_states(self._pool, slots, self._filter, self._biases)

    def _confirmed(self, slots: NDArray[np.intp]) -> NDArray[np.bool_]:
        return self._pool.confirmed(slots, self._settings.confirm_updates)

    def _pop_pictures(self) -> tuple[Picture, ...]:
        pictures, self._pictures = self._pictures, None if self._pictures is None else []
        return tuple(pictures or ())

    def _open_epoch(self, opened: int, row: int) -> EndedTracks:
        """Drop the tracks without recent updates, and drift the biases up to the epoch."""
        start_s = opened * self._settings.epoch_s
        old = self._pool.silent(start_s - self._settings.drop_after_s)
        ends = self._pool.terminate(old, np.where(self._confirmed(old), SILENT, UNCONFIRMED))
        ended = self._terminate(row, start_s, ends)
        live = self._pool.used()
        self._pool.release_confirmed(live[self._confirmed(live)])
        self._transitions.check_coasting(row, start_s)
        self._biases.drift(start_s, self._pool)
        self._steps = self._biases.steps(self._settings.epoch_s)
        return ended

    def _terminate(self, row: int, time_s: float, ends: TerminatedTracks) -> EndedTracks:
        """Record tracks terminated before a row."""
        self._transitions.terminate(row, time_s, ends)
        self._record_delays(ends.slot, ends.track_id)
        times_s = np.full(len(ends.track_id), time_s)
        return EndedTracks(ends.track_id, times_s, ends.reason.astype(np.int8), ends.into)

    def _record_delays(self, slots: NDArray[np.int64], track_id: NDArray[np.int64]) -> None:
        kept = self._confirmed(slots)
        self._delays.add(
            slots[kept], track_id[kept], self._pool.aircraft, self._pool.roster, self._biases.model
        )
