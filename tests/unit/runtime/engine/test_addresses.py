"""Mode S addresses: a plot updates no track of another aircraft."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.tracking.association._revolution_kernels import is_second_azimuth
from multiradar.tracking.health.health_records import ALARM_ADDRESS, ALARM_NAMES
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import STATE_CONFIRMED, TrackUpdates
from multiradar.tracking.roster import RowIdentities
from multiradar.tracking.settings import BY_PROBABILITY, TrackingSettings
from support.scenarios.scenes import Flight, Radar, Scene, make_scene, three_radars

#: The recordings of a Mode S radar have no track numbers.
BY_ADDRESS = TrackingSettings(hidden_fields=("track_number",))
ARRIVAL, DEPARTURE, GARBLED = 0x400000, 0x400001, 0x6B1805


def updated(
    scene: Scene, batch: MeasurementBatch, settings: TrackingSettings = BY_ADDRESS
) -> TrackUpdates:
    """Track a batch; every update has the address of its measurement."""
    engine = Engine(scene.sensors, settings)
    outputs = [engine.push(batch), engine.flush()]
    engine.close()
    assert all((output.health.alarms >> ALARM_ADDRESS == 0).all() for output in outputs)
    updates = TrackUpdates.concatenate([output.updates for output in outputs])
    both = (updates.mode_s_address >= 0) & (updates.measured_mode_s_address >= 0)
    assert (updates.mode_s_address == updates.measured_mode_s_address)[both].all()
    for track in np.unique(updates.track_id):
        known = updates.mode_s_address[updates.track_id == track]
        assert len(np.unique(known[known >= 0])) <= 1
    return updates


def addressed(scene: Scene, address: NDArray[np.int64]) -> MeasurementBatch:
    codes = np.full(len(scene.batch), -1, np.int32)
    return replace(scene.batch, mode_s_address=address, mode_3a=codes)


@pytest.fixture(scope="module")
def runway() -> Scene:
    """An aircraft lands; 20 s later another takes off where the first would be, and goes on."""
    radar = Radar("A", 55.9, 60.2, rotation_s=4.0)
    landing = Flight(0.0, 100.0, (-12e3, 4e3, 75.0, 0.0), 300.0)
    departing = Flight(120.0, 300.0, (-3e3, 4e3, 75.0, 0.0), 300.0)
    return make_scene(np.random.default_rng(1), [radar], [landing, departing])


@pytest.fixture(scope="module")
def single() -> Scene:
    flight = Flight(0.0, 160.0, (-3e4, 2e4, 180.0, 40.0))
    return make_scene(np.random.default_rng(2), [Radar("A", 55.9, 60.2, rotation_s=4.0)], [flight])


@pytest.mark.parametrize("association", ["nearest", BY_PROBABILITY])
@pytest.mark.parametrize("name", ["two-stage", "imm"])
def test_a_departure_does_not_take_over_the_track_of_an_arrival(
    runway: Scene, name: str, association: str
) -> None:
    settings = replace(BY_ADDRESS, filter_name=name, association=association)
    updates = updated(runway, addressed(runway, runway.batch.mode_s_address), settings)
    pairs = np.unique(np.stack([updates.track_id, updates.mode_s_address]), axis=1)
    assert pairs.T.tolist() == [[1, ARRIVAL], [2, DEPARTURE]]


def test_a_garbled_address_updates_no_track_and_breaks_none(single: Scene) -> None:
    address = single.batch.mode_s_address.copy()
    address[12] = GARBLED
    updates = updated(single, addressed(single, address))
    assert set(updates.track_id.tolist()) == {1, 2}
    assert updates.mode_s_address[updates.track_id == 2].tolist() == [GARBLED]
    assert not (updates.state[updates.track_id == 2] == STATE_CONFIRMED).any()


def test_a_garbled_address_does_not_become_that_of_a_track_without_one(single: Scene) -> None:
    address = single.batch.mode_s_address.copy()
    address[:12] = -1
    address[12] = GARBLED
    updates = updated(single, addressed(single, address))
    assert set(updates.track_id.tolist()) == {1}
    assert updates.mode_s_address[12:15].tolist() == [-1, -1, ARRIVAL]
    assert updates.measured_mode_s_address[12:15].tolist() == [GARBLED, ARRIVAL, ARRIVAL]


def test_a_track_that_a_garbled_address_initiated_ends_unconfirmed(single: Scene) -> None:
    address = single.batch.mode_s_address.copy()
    address[0] = GARBLED
    updates = updated(single, addressed(single, address))
    assert updates.track_id[1:].tolist() == [2] * (len(updates) - 1)
    assert updates.state[0] != STATE_CONFIRMED


def test_a_lasting_change_of_address_initiates_a_track(single: Scene) -> None:
    address = np.where(np.arange(len(single.batch)) < 15, ARRIVAL, GARBLED)
    updates = updated(single, addressed(single, address))
    assert updates.track_id.tolist() == [1] * 15 + [2] * (len(updates) - 15)
    assert updates.state[-1] == STATE_CONFIRMED


def test_a_track_number_passes_to_another_address_with_its_second_plot(single: Scene) -> None:
    garbled, changed = single.batch.mode_s_address.copy(), single.batch.mode_s_address.copy()
    garbled[12] = GARBLED
    updates = updated(single, addressed(single, garbled), TrackingSettings())
    assert updates.track_id[12:14].tolist() == [2, 1]
    assert updates.track_number[12:14].tolist() == [-1, 1]
    changed[12:20], changed[20:] = GARBLED, -1
    updates = updated(single, addressed(single, changed), TrackingSettings())
    assert updates.track_id[12:].tolist() == [2] * (len(updates) - 12)
    assert updates.track_number[12:14].tolist() == [-1, 1]


def test_plots_without_address_and_other_codes_update_the_track(single: Scene) -> None:
    address = single.batch.mode_s_address.copy()
    address[10::2] = -1
    codes = np.where(np.arange(len(address)) < 20, 0o1234, 0o7700).astype(np.int32)
    updates = updated(single, replace(addressed(single, address), mode_3a=codes))
    assert set(updates.track_id.tolist()) == {1}
    assert updates.mode_3a[-1] == 0o7700


@pytest.mark.fault(18)
def test_plots_of_two_addresses_in_one_window_initiate_two_tracks() -> None:
    radars = [replace(radar, rotation_s=4.0) for radar in three_radars()[:2]]
    scene = make_scene(
        np.random.default_rng(3), radars, [Flight(0.0, 60.0, (2e4, 3e4, 150.0, 80.0))]
    )
    # The second radar sees another aircraft at the same position.
    address = np.where(scene.batch.sensor == 0, ARRIVAL, DEPARTURE)
    updates = updated(scene, addressed(scene, address))
    pairs = np.unique(np.stack([updates.track_id, updates.mode_s_address]), axis=1)
    assert pairs.shape[1] == 2


@pytest.mark.fault(18)
def test_an_update_by_another_address_raises_an_alarm(single: Scene) -> None:
    # Association excludes it: the outcome is given.
    row = single.batch.select(slice(0, 1))
    engine = Engine(single.sensors, BY_ADDRESS)
    rows, result, _ = engine._prepare(row)
    identities = RowIdentities.empty(1)
    identities.mode_s_address[:] = GARBLED
    engine._health.gather(
        rows._replace(slot=identities.slot), result, identities, row.mode_s_address, engine._pool,
        first=0, last=1,
    )  # fmt: skip
    health = engine._health.close(0, 4.0, engine.biases, engine._pool)
    assert ALARM_NAMES[ALARM_ADDRESS] == "address"
    assert health.records.alarms.tolist() == [1 << ALARM_ADDRESS]


def with_reflections(scene: Scene, turned_deg: float, address: int) -> MeasurementBatch:
    """Every third plot again, from the fifth on, when the antenna points elsewhere."""
    batch = addressed(scene, scene.batch.mode_s_address)
    ghosts = batch.select(slice(4, None, 3))
    turned = np.radians(turned_deg)
    ghosts = replace(
        ghosts, azimuth_rad=(ghosts.azimuth_rad + turned) % (2.0 * np.pi),
        time_s=ghosts.time_s + turned / (2.0 * np.pi) * scene.sensors.rotation_period_s[0],
        mode_s_address=np.full(len(ghosts), address),
    )  # fmt: skip
    both = MeasurementBatch.concatenate([batch, ghosts])
    return both.select(np.argsort(both.time_s, kind="stable"))


@pytest.fixture(scope="module")
def parked() -> Scene:
    radar = Radar("A", 55.9, 60.2, rotation_s=4.0)
    flight = Flight(0.0, 120.0, (1200.0, 3000.0, 1.0, 0.0), 310.0)
    return make_scene(np.random.default_rng(4), [radar], [flight])


# In the window of the plot, in a later one, and before the plot.
@pytest.mark.parametrize("turned_deg", [13.0, 80.0, -13.0])
@pytest.mark.parametrize("address", [ARRIVAL, -1])
def test_a_revolution_updates_a_track_from_one_azimuth(
    parked: Scene, turned_deg: float, address: int
) -> None:
    batch = with_reflections(parked, turned_deg, address)
    updates = updated(parked, batch)
    # Far away it may be another aircraft with the same address, which has a track of its own.
    track = np.bincount(updates.track_id).argmax()
    mine = updates.time_s[updates.track_id == track]
    assert (np.diff(mine) > 3.0).all()
    own = np.isin(mine, parked.batch.time_s)
    assert own[2:].all()
    assert len(mine) >= len(parked.batch) - 1
    assert updates.speed_mps[updates.track_id == track][6:].max() < 60.0


def test_a_second_azimuth_is_of_the_same_revolution_and_beyond_the_beam() -> None:
    def second(since_s: float, turned_deg: float, period_s: float = 4.0) -> bool:
        return bool(is_second_azimuth(since_s, np.radians(turned_deg), period_s))

    assert second(0.14, 13.0)
    assert second(0.14, 13.0 - 360.0)
    assert second(1.9, 170.0)
    # Split by the beam; in the next revolution; after a pass close to the radar; period unknown.
    assert not second(0.02, 2.0)
    assert not second(4.14, 13.0)
    assert not second(3.86, -13.0)
    assert not second(2.2, -160.0)
    assert not second(0.14, 13.0, 0.0)
