"""Which sensors measure from one site."""

from dataclasses import replace
from typing import Any

import numpy as np

from multiradar.estimation.measurement.kinds import KIND_BEARING, KIND_POSITION, KIND_RADAR
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_FRAME_EAST,
    PARAMETER_FRAME_ROTATION,
)
from multiradar.estimation.measurement.sites import ONE_SITE_M, numbers_of_sites
from support.scenarios.scenes import make_scene, random_flights, three_radars


def numbers_of(kinds: list[int], north_m: list[float], *, moving: int = -1) -> list[int]:
    radar = three_radars()[0]
    radars = [
        replace(
            radar,
            identifier=f"S{i}",
            latitude_deg=radar.latitude_deg + away / 111_300.0,
            biases={},
        )
        for i, away in enumerate(north_m)
    ]
    rng = np.random.default_rng(1)
    table = make_scene(rng, radars, random_flights(rng, 1, 10.0)).sensors
    table = replace(
        table,
        kinds=np.array(kinds, np.int8),
        moving=np.arange(len(kinds)) == moving,
    )
    numbers: list[int] = numbers_of_sites(table).tolist()
    return numbers


def test_radars_on_one_mast_are_one_site() -> None:
    assert numbers_of([KIND_RADAR] * 3, [0.0, 0.0, 1.1 * ONE_SITE_M]) == [0, 0, 2]
    assert numbers_of([KIND_RADAR, KIND_BEARING], [0.0, 0.9 * ONE_SITE_M]) == [0, 0]


def test_reported_positions_are_not_measured_from_their_station() -> None:
    kinds = [KIND_RADAR, KIND_POSITION, KIND_POSITION, KIND_RADAR]
    assert numbers_of(kinds, [0.0] * 4) == [0, 1, 2, 0]
    # Nor does a station come between radars.
    assert numbers_of([KIND_POSITION, KIND_RADAR, KIND_RADAR], [0.0] * 3) == [0, 1, 1]


def test_a_moving_sensor_has_a_site_of_its_own() -> None:
    assert numbers_of([KIND_BEARING, KIND_RADAR], [0.0, 0.0], moving=0) == [0, 1]


def test_an_estimated_frame_counts_as_the_site_of_the_nearest_turned_radar() -> None:
    """Two radars 30 km apart, and multilateration 25 km from the first."""
    radar, north_m = three_radars()[0], (0.0, 30e3, 25e3)
    radars = [
        replace(radar, identifier=f"S{i}", latitude_deg=radar.latitude_deg + away / 111_300.0)
        for i, away in enumerate(north_m)
    ]
    turned = {PARAMETER_AZIMUTH_OFFSET: 0.0}
    frame = dict.fromkeys((PARAMETER_FRAME_EAST, PARAMETER_FRAME_ROTATION), 0.0)

    def numbers(
        first: dict[int, float],
        second: dict[int, float],
        third: dict[int, float],
        kinds: tuple[int, ...] = (KIND_RADAR, KIND_RADAR, KIND_POSITION),
    ) -> Any:
        own = [replace(one, biases={}) for one in radars]
        rng = np.random.default_rng(1)
        table = make_scene(rng, own, random_flights(rng, 1, 10.0)).sensors
        listed = [(i, k) for i, one in enumerate((first, second, third)) for k in sorted(one)]
        count = len(listed)
        return numbers_of_sites(
            replace(
                table,
                kinds=np.array(kinds, np.int8),
                parameter_sensor=np.array([i for i, _ in listed], np.int32),
                parameter_kind=np.array([k for _, k in listed], np.int8),
                prior_mean=np.zeros(count),
                prior_sigma=np.full(count, 0.1),
                drift=np.zeros(count),
            )
        ).tolist()

    assert numbers(turned, turned, frame) == [0, 1, 1]
    assert numbers(turned, {}, frame) == [0, 1, 0]
    # Another frame that is estimated may be turned, too.
    assert numbers({}, frame, frame, (KIND_RADAR, KIND_POSITION, KIND_POSITION)) == [0, 1, 1]
    # Radars with known azimuths anchor it, and a rotation alone is about a known point.
    assert numbers({}, {}, frame) == [0, 1, 2]
    assert numbers(turned, turned, {PARAMETER_FRAME_ROTATION: 0.0}) == [0, 1, 2]
