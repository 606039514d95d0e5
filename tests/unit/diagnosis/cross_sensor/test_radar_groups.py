"""Groups of radars for the joint fits of a diagnosis."""

from typing import cast

import numpy as np

from multiradar.diagnosis.cross_sensor.agreement import NO_AGREEMENT
from multiradar.diagnosis.cross_sensor.comparison import Comparison
from multiradar.diagnosis.cross_sensor.radar_groups import GROUP_MAX, Compared, grouped
from multiradar.diagnosis.cross_sensor.references import RECORDING, Pairs

RADARS, ADSB = 50, 50


class Radars:
    """The part of a comparison that knows the kinds of sensors."""

    def is_radar(self, number: int) -> bool:
        """Return whether a sensor is a radar."""
        return number != ADSB


COMPARISON = cast(Comparison, Radars())


def chain(count: int) -> Compared:
    """Return radars in a row: each has pairs with its neighbours, ADS-B and the recording."""
    compared = {}
    for number in range(count):
        near = [one for one in (number - 1, number + 1) if 0 <= one < count]
        source = np.array([*near, ADSB, RECORDING], np.int64)
        size = len(source)
        compared[number] = (
            NO_AGREEMENT,
            Pairs(
                np.arange(size), source, np.arange(size), np.zeros((size, 3)), np.zeros((size, 3))
            ),
        )
    return compared


def test_radars_that_fit_into_one_group_are_not_divided() -> None:
    compared = chain(GROUP_MAX)
    assert grouped(COMPARISON, compared)[0] is compared


def test_groups_are_of_neighbours_and_contain_every_radar_once() -> None:
    groups = grouped(COMPARISON, chain(RADARS))
    assert sorted(one for group in groups for one in group) == list(range(RADARS))
    for group in groups:
        assert len(group) <= GROUP_MAX
        assert max(group) - min(group) == len(group) - 1


def test_pairs_with_radars_of_other_groups_are_left_out() -> None:
    for group in grouped(COMPARISON, chain(RADARS)):
        for _, pairs in group.values():
            assert {ADSB, RECORDING} <= set(pairs.source.tolist()) <= {*group, ADSB, RECORDING}
