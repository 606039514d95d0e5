"""System tracks in data time: independent of the batches of output, with true ages."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from multiradar.errors import ConfigurationError
from multiradar.runtime.asterix.channel import Channel, ChannelOptions
from multiradar.runtime.asterix.cycles import Cycles
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch
from multiradar_converters.asterix.writing.track_reports import TrackReports
from multiradar_schemas.measurements.callsigns import callsign_texts
from support.asterix.reports import SENDER
from support.scenarios.live_scene import START_S, cut, recording, sensors

TABLE = sensors()
TRACKING = TrackingSettings(filter_name="imm")


class Kept(Channel):
    """A channel that keeps its reports."""

    def __init__(self, **said: float) -> None:
        super().__init__(ChannelOptions(SENDER, **said))  # type: ignore[arg-type]
        self.received: list[TrackReports] = []

    def choose(self, reports: TrackReports) -> TrackReports:
        self.received.append(super().choose(reports))
        return self.received[-1]


def outputs(pieces: Iterable[pl.DataFrame]) -> list[EngineOutput]:
    engine = Engine(TABLE, TRACKING)
    made = [engine.push(measurement_batch(piece, TABLE)[0]) for piece in pieces]
    return [*made, engine.flush()]


def octets(pieces: Sequence[pl.DataFrame]) -> bytes:
    user = Channel(ChannelOptions(SENDER, period_s=1.5))
    cycles = Cycles(TABLE, TRACKING, [user])
    received = [one for output in outputs(pieces) for one in cycles.push(output)]
    received += list(cycles.finish())
    return b"".join(block for one in received for block in one.blocks)


def followed(frame: pl.DataFrame, **said: float) -> list[TrackReports]:
    user = Kept(**said)
    cycles = Cycles(TABLE, TRACKING, [user])
    for output in outputs([frame]):
        list(cycles.push(output))
    return user.received


@pytest.mark.slow
def test_the_octets_do_not_depend_on_the_batches() -> None:
    frame = recording(600)
    whole = octets([frame])
    assert len(whole) > 5_000
    assert octets(cut(frame, [1, 2, 150, 17, 1, 250])) == whole
    assert octets(cut(frame, [7] * 85)) == whole


def test_every_track_is_reported_with_its_callsign() -> None:
    whole = followed(recording(600))
    assert len(whole) > 2
    for one in whole:
        numbers = (one.mode_s_address - 0x4B0000).tolist()
        assert callsign_texts(one.callsign).to_list() == [f"TST{number}" for number in numbers]


def test_cycles_are_whole_periods_of_each_user() -> None:
    slow, fast = Kept(period_s=8.0), Kept(period_s=2.5, status_period_s=5.0)
    cycles = Cycles(TABLE, TRACKING, [slow, fast])
    times: dict[int, set[float]] = {0: set(), 1: set()}
    for output in outputs([recording(1000)]):
        for one in cycles.push(output):
            times[one.channel].add(one.time_s - START_S)
    assert [one.time_s - START_S for one in slow.received] == [8.0, 16.0, 24.0, 32.0, 40.0, 48.0]
    assert [one.time_s - START_S for one in fast.received] == [2.5 * k for k in range(1, 20)]
    assert times[0] <= {8.0 * k for k in range(1, 7)}
    # A cycle contains measurements before its time, not at it.
    assert min(np.nanmin(one.age_s) for one in fast.received) > 0.0


def test_a_track_is_extrapolated_from_its_last_update() -> None:
    frame = recording(1500)
    reports = followed(frame, period_s=4.0)[-1]
    assert len(reports) == 12
    # The scenario: 12 aircraft on straight lines, with known positions at any time.
    number = reports.mode_s_address - 0x4B0000
    time_s = reports.time_s - START_S
    latitude = 49.5 + 0.05 * number + 0.001 * (number % 3 - 1) * time_s / 10.0
    longitude = 15.0 + 0.07 * number + 0.0002 * time_s
    north_m = (reports.latitude_deg - latitude) * 111_200.0
    east_m = (reports.longitude_deg - longitude) * 72_000.0
    # Radars with 50 m and 0.06° at 100 km: a hundred metres, four sigma.
    assert np.hypot(north_m, east_m).max() < 150.0
    # The reported sigma agrees with it.
    ratio = np.sqrt(north_m**2 / reports.variance_north_m2 + east_m**2 / reports.variance_east_m2)
    assert ratio.max() < 4.0
    assert reports.velocity_east_mps == pytest.approx(0.0002 * 72_000.0, abs=6.0)
    assert reports.barometric_m == pytest.approx(9000.0 + 100.0 * number, abs=30.0)
    assert np.isnan(reports.geometric_m).all()


def test_tracks_without_plots_coast_and_are_reported_once_more_when_dropped() -> None:
    frame = recording(3000)
    time_s = frame["time_s"] - START_S
    rounds = followed(frame.filter((frame["track_number"] != 3) | (time_s < 30.0)), period_s=4.0)
    silent = [one.select(one.mode_s_address == 0x4B0003) for one in rounds]
    silent = [one for one in silent if len(one)]
    assert [one.first[0] for one in silent] == [True] + [False] * (len(silent) - 1)
    assert [one.last[0] for one in silent] == [False] * (len(silent) - 1) + [True]
    age_s = np.array([np.nanmin(one.age_s) for one in silent])
    coasting = np.array([one.coasting[0] for one in silent])
    # Ages are those since the last update; with them the accuracy grows and the bit is set.
    assert (coasting == (age_s > TRACKING.coast_after_s)).all()
    assert coasting.any()
    assert age_s[-1] == pytest.approx(TRACKING.drop_after_s, abs=8.0)
    sigma_m = np.sqrt([one.variance_north_m2[0] for one in silent])
    assert (np.diff(sigma_m[coasting]) > 0.0).all()
    others = [one.select(one.mode_s_address != 0x4B0003) for one in rounds]
    assert not any(one.last.any() for one in others)


def test_every_user_gets_the_end_of_a_track_once_with_any_period() -> None:
    frame = recording(3000)
    time_s = frame["time_s"] - START_S
    users = [Kept(period_s=2.5), Kept(period_s=8.0)]
    cycles = Cycles(TABLE, TRACKING, users)
    for output in outputs([frame.filter((frame["track_number"] != 3) | (time_s < 30.0))]):
        list(cycles.push(output))
    for user in users:
        ended = [one.mode_s_address[one.last].tolist() for one in user.received if one.last.any()]
        assert ended == [[0x4B0003]]


def test_a_gap_in_the_data_is_skipped() -> None:
    frame = recording(2000)
    later = pl.when(pl.col("time_s") > START_S + 50.0).then(36_000.0).otherwise(0.0)
    rounds = followed(frame.with_columns(pl.col("time_s") + later))
    # 25 rounds of measurements, 17 until the last track is given up, none for the ten hours.
    assert len(rounds) < 50
    assert rounds[-1].time_s > START_S + 36_000.0
    resumed = [one for one in rounds if one.time_s > START_S + 20_000.0]
    assert resumed[0].first.any()


def test_the_last_plot_is_reported_bias_corrected() -> None:
    reports = followed(recording(1500))[-1]
    plot = reports.sensor >= 0
    assert plot.any()
    assert set(reports.sensor[plot].tolist()) <= {41 << 8 | 10, 41 << 8 | 20}
    assert set(reports.plot_type[plot].tolist()) == {5}
    assert reports.plot_mode_3a[plot].tolist() == reports.mode_3a[plot].tolist()


def test_a_loss_is_reported_once_to_the_user() -> None:
    user = Kept(status_period_s=1.0)
    cycles = Cycles(TABLE, TRACKING, [user])
    made = outputs([recording(400)])
    cycles.overloaded.add(0)
    blocks = [block for output in made for one in cycles.push(output) for block in one.blocks]
    states = [block for block in blocks if block[0] == 65 and block[3] == 0xF4]
    assert [block[-1] for block in states] == [0x60] + [0] * (len(states) - 1)
    assert len(states) > 5


def test_output_without_plots_or_covariance_is_an_error() -> None:
    cycles = Cycles(TABLE, TRACKING, [Kept()])
    received, _ = outputs([recording(200)])
    with pytest.raises(ValueError, match="one plot and one covariance per update"):
        list(cycles.push(replace(received, spread=received.spread[:3])))


def test_empty_output_gives_no_reports() -> None:
    cycles = Cycles(TABLE, TRACKING, [Kept()])
    assert [list(cycles.push(output)) for output in outputs([])] == [[]]
    assert list(cycles.finish()) == []


@pytest.mark.parametrize("period_s", [0.0, 0.3, -4.0, float("nan")])
def test_periods_are_multiples_of_the_release_step(period_s: float) -> None:
    user = Channel(replace(ChannelOptions(SENDER), period_s=period_s))
    with pytest.raises(ConfigurationError, match=r"multiple of 0\.5 s"):
        Cycles(TABLE, TRACKING, [user])
