"""States of aircraft as words: exact for every filter, NaN and signed zero included."""

import numpy as np
import pytest

from multiradar.cluster.packing import Packing, copied
from multiradar.estimation.filters.arrays import Aircraft
from multiradar.estimation.filters.bank import FILTERS

SLOTS = 48
DISTRIBUTED = [name for name, one in FILTERS.items() if not one.corrects_biases]


def filled(name: str) -> Aircraft:
    rng = np.random.default_rng(1)
    aircraft = FILTERS[name].aircraft(SLOTS, 6, 3, 4, delays=FILTERS[name].estimates_delays)
    for one in aircraft:
        one[...] = rng.integers(-(2**62), 2**62, one.shape).view(one.dtype)
    aircraft.time[3], aircraft.height[3] = np.nan, -0.0
    return aircraft


@pytest.mark.parametrize("name", DISTRIBUTED)
def test_states_come_back_bit_by_bit(name: str) -> None:
    aircraft, slots = filled(name), np.array([3, 17, 40])
    packing = Packing.of(aircraft)
    words = packing.pack(aircraft, slots)
    assert words.shape == (3, packing.width)
    other = packing.empty(SLOTS)
    packing.unpack(words, other, slots)
    assert (packing.pack(other, slots) == words).all()
    assert not packing.pack(other, np.array([4])).any()


@pytest.mark.parametrize("name", DISTRIBUTED)
def test_every_array_is_in_the_words(name: str) -> None:
    aircraft = filled(name)
    packing = Packing.of(aircraft)
    before = packing.pack(aircraft, np.arange(SLOTS))
    used = [field for field, one in zip(aircraft._fields, aircraft, strict=True) if one.size]
    for field in used:
        getattr(aircraft, field).view(np.int64)[...] ^= 1
    assert (packing.pack(aircraft, np.arange(SLOTS)) != before).all()


def test_states_stay_where_there_is_more_room() -> None:
    aircraft = filled("imm")
    packing, every = Packing.of(aircraft), np.arange(SLOTS)
    larger = copied(aircraft, packing.empty(2 * SLOTS))
    assert (packing.pack(larger, every) == packing.pack(aircraft, every)).all()
