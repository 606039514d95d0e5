"""System tracks in ASTERIX: `cd tests && python -m benchmark.asterix_output`.

Simulated aircraft are updated once per scan of 4 s. Results are records of category 062 per second
of process time on one core, the best of several scans: of the whole path from the engine's output
to blocks (tracks kept, extrapolated, selected for a user with a Cartesian plane, written), and of
the writing alone.
"""

from time import process_time

import numpy as np

from multiradar.geodesy.stereographic import StereographicPlane
from multiradar.runtime.asterix.channel import Channel, ChannelOptions
from multiradar.runtime.asterix.cycles import Cycles
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import (
    BiasRecords,
    EndedTracks,
    EngineOutput,
    TrackPlots,
    TrackUpdates,
)
from multiradar.tracking.settings import TrackingSettings
from multiradar_converters.asterix.writing.encoding import blocks
from multiradar_converters.asterix.writing.senders import Sender
from multiradar_converters.asterix.writing.track_reports import CATEGORY, track_records
from support.scenarios.live_scene import sensors

AIRCRAFT = (200, 2000, 10_000)
TURNS = 10
TURN_S = 4.0
SENDER = Sender(20, 250, 1)


def turn(count: int, number: int, random: np.random.Generator) -> EngineOutput:
    """Return the output of the engine for a scan: every aircraft once."""

    def same(value: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        return np.full(count, value)

    identity = np.arange(count, dtype=np.int64)
    nothing = np.zeros(count, np.int8)
    updates = TrackUpdates(
        sequence=identity + 1 + number * count,
        time_s=TURN_S * (number + np.sort(random.uniform(0.0, 1.0, count))),
        track_id=identity + 1,
        sensor=np.zeros(count, np.int32),
        track_number=identity,
        mode_s_address=identity,
        mode_3a=np.full(count, 0o1234, np.int32),
        latitude_rad=np.radians(random.uniform(46.0, 54.0, count)),
        longitude_rad=np.radians(random.uniform(9.0, 21.0, count)),
        height_m=same(9000.0),
        speed_mps=same(200.0),
        heading_rad=random.uniform(0.0, 6.2, count),
        position_sigma_m=same(50.0),
        velocity_sigma_mps=same(3.0),
        state=nothing + 1,
        turn_right_probability=same(0.1),
        turn_left_probability=same(0.1),
        speed_change_probability=same(0.1),
        vertical_rate_mps=same(1.0),
        height_sigma_m=same(10.0),
        adsb_implausible=nothing != 0,
        callsign=np.full(count, -1, np.int64),
        measured_mode_s_address=identity,
        on_ground=np.full(count, -1, np.int8),
    )
    measured = MeasurementBatch(
        time_s=updates.time_s,
        sensor=updates.sensor,
        kind=nothing,
        range_m=same(1e5),
        azimuth_rad=same(1.0),
        latitude_rad=same(np.nan),
        longitude_rad=same(np.nan),
        height_m=same(9000.0),
        mode_3a=updates.mode_3a,
        mode_s_address=identity,
        track_number=identity,
        callsign=updates.callsign,
    )
    places = [random.uniform(-3e5, 3e5, count), random.uniform(-3e5, 3e5, count)]
    return EngineOutput(
        updates,
        BiasRecords.concatenate([]),
        EndedTracks.concatenate([]),
        plots=TrackPlots(updates.track_id, measured),
        spread=np.stack([*places, same(900.0), same(10.0), same(900.0)], axis=1),
    )


def measure(count: int) -> tuple[float, float]:
    """Return records per second of the whole path and of the writing alone."""
    random = np.random.default_rng(1)
    user = Channel(ChannelOptions(SENDER, plane=StereographicPlane(0.87, 0.26)))
    cycles = Cycles(sensors(), TrackingSettings(), [user])
    whole = writing = 0.0
    # The first scans compile, and have no output yet.
    for number, output in enumerate([turn(count, k, random) for k in range(TURNS + 2)]):
        before, start = user.counts[f"{CATEGORY:03d}"], process_time()
        octets = sum(len(block) for sent in cycles.push(output) for block in sent.blocks)
        spent = process_time() - start
        if number >= 2 and octets:
            whole = max(whole, (user.counts[f"{CATEGORY:03d}"] - before) / spent)
    reports = user.choose(cycles.tracks.reports(TURN_S * (TURNS + 2)))
    for _ in range(TURNS):
        start = process_time()
        blocks(CATEGORY, track_records(reports, SENDER).written())
        writing = max(writing, count / (process_time() - start))
    return whole, writing


def main() -> None:
    """Print the figures."""
    print(f"{'aircraft':>10}{'whole, records/s':>20}{'writing, records/s':>20}")
    for count in AIRCRAFT:
        whole, writing = measure(count)
        print(f"{count:>10,}{whole:>20,.0f}{writing:>20,.0f}")


if __name__ == "__main__":
    main()
