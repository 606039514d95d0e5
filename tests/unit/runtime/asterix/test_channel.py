"""The reports of each track to a user, with its first and last one."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from multiradar.geodesy.stereographic import StereographicPlane
from multiradar.runtime.asterix.channel import Channel, ChannelOptions
from multiradar_converters.asterix.writing.track_reports import TrackReports
from support.asterix.reports import SENDER, reports


def channel(**said: Any) -> Channel:
    return Channel(ChannelOptions(SENDER, **said))


def received(user: Channel, tracks: TrackReports) -> list[tuple[int, bool, bool]]:
    """Number, first and last of each report."""
    chosen = user.choose(tracks)
    return list(
        zip(chosen.number.tolist(), chosen.first.tolist(), chosen.last.tolist(), strict=True)
    )


def test_a_track_has_one_first_and_one_last_report() -> None:
    user = channel()
    assert received(user, reports(2)) == [(0, True, False), (1, True, False)]
    assert received(user, reports(2)) == [(0, False, False), (1, False, False)]
    ended = replace(reports(2), last=np.array([False, True]))
    assert received(user, ended) == [(0, False, False), (1, False, True)]
    assert received(user, ended) == [(0, False, False)]
    # The number is reused by another track.
    assert received(user, reports(2)) == [(0, False, False), (1, True, False)]


def test_a_track_dropped_before_its_first_report_is_not_reported() -> None:
    assert received(channel(), reports(last=True)) == []


def test_a_track_that_leaves_the_area_has_a_last_report() -> None:
    user = channel(area_deg=(14.0, 49.0, 16.0, 51.0))
    assert received(user, reports(2, longitude_deg=[15.0, 17.0])) == [(0, True, False)]
    assert received(user, reports(2, longitude_deg=[17.0, 15.0])) == [
        (0, False, True),
        (1, True, False),
    ]
    assert received(user, reports(2, longitude_deg=[15.0, 15.0])) == [
        (0, True, False),
        (1, False, False),
    ]


def test_an_area_across_the_antimeridian_includes_both_its_ends() -> None:
    user = channel(area_deg=(170.0, -10.0, -170.0, 10.0))
    places = reports(
        4, longitude_deg=[175.0, -175.0, 0.0, 180.0], latitude_deg=[0.0, 5.0, 0.0, -9.0]
    )
    assert [number for number, *_ in received(user, places)] == [0, 1, 3]


def test_tentative_tracks_are_reported_unless_excluded() -> None:
    tracks = reports(2, tentative=np.array([True, False]))
    assert [number for number, *_ in received(channel(), tracks)] == [0, 1]
    assert [number for number, *_ in received(channel(tentative=False), tracks)] == [1]


def test_a_new_code_is_marked_once_for_each_user() -> None:
    user = channel()
    assert not user.choose(reports(mode_3a=-1)).code_changed.any()
    assert not user.choose(reports(mode_3a=0o1234)).code_changed.any()
    assert user.choose(reports(mode_3a=0o7700)).code_changed.all()
    assert not user.choose(reports(mode_3a=0o7700)).code_changed.any()


def test_a_plane_gives_cartesian_positions_and_covariances() -> None:
    plane = StereographicPlane(*np.radians([47.0, 8.0]).tolist())
    chosen = channel(plane=plane).choose(reports(covariance_m2=100.0))
    assert chosen.x_m[0] == pytest.approx(plane.to_plane(*np.radians([50.0, 15.0]))[0])
    # Turned and stretched, the area of the ellipse grows by the square of the scale alone.
    scale = np.linalg.det(plane.matrix(*np.radians([50.0, 15.0])))
    area = chosen.variance_x_m2 * chosen.variance_y_m2 - chosen.covariance_xy_m2**2
    assert area[0] == pytest.approx((900.0 * 400.0 - 100.0**2) * scale**2)
    # East of the centre, true north leans to the west on the plane: what was long is now lower.
    assert chosen.variance_x_m2[0] < 900.0 * scale


def test_blocks_respect_the_maximum_and_end_with_the_end_of_batch() -> None:
    user = channel(block_octets_max=500)
    blocks = user.tracks(reports(100))
    assert {block[0] for block in blocks[:-1]} == {62}
    assert blocks[-1][0] == 65
    assert max(map(len, blocks)) <= 500
    assert user.counts == {"062": 100, "065": 1}


def test_items_left_out_are_counted() -> None:
    user = channel()
    user.tracks(reports(3, velocity_east_mps=[1.0, 9000.0, 9000.0]))
    assert user.counts["062/185"] == 2
