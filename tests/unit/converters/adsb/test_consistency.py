"""Repeated and stale reports are found among reports of other aircraft."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from multiradar_converters.adsb.consistency import SPEED_MAX_MPS, STALE_M, STEP_S, ConsistencyCheck
from multiradar_converters.adsb.reading import roles
from multiradar_converters.adsb.reading.batches import Batch
from multiradar_converters.errors import LayoutError

METRE_DEG = 1.0 / 111_195.0
SAMPLES = 400


@dataclass
class Plain:
    """Reference consistency check of the reports of one aircraft."""

    last: tuple[float, float, float] | None = None
    since: float = 0.0
    backwards: int = 0
    jumps: int = 0
    rejected: list[str] = field(default_factory=list)

    def stands(self, time: float, latitude: float, longitude: float, speed: float) -> bool:
        if self.last is None:
            self.last, self.since = (time, latitude, longitude), time
            return True
        before, was_latitude, was_longitude = self.last
        self.backwards += time < before
        if (latitude, longitude) == (was_latitude, was_longitude):
            if time in (before, self.since):
                self.rejected.append("repeated")
                return False
            if time > self.since and speed * (time - self.since) > STALE_M:
                self.rejected.append("stale")
                return False
            self.since = min(self.since, time)
        else:
            moved = np.hypot(
                latitude - was_latitude,
                (longitude - was_longitude) * np.cos(np.radians(latitude)),
            )
            self.jumps += moved / METRE_DEG > SPEED_MAX_MPS * (abs(time - before) + STEP_S)
            self.since = time
        self.last = (time, latitude, longitude)
        return True


def batch(reports: np.ndarray, address: np.ndarray) -> Batch:
    numbers = np.full((roles.NUMBERS, len(reports)), np.nan)
    numbers[[roles.TIME, roles.LATITUDE, roles.LONGITUDE, roles.SPEED]] = reports.T
    words = np.full((roles.WORDS, len(reports)), roles.ABSENT, dtype=np.int64)
    words[0] = address
    return Batch(numbers, words, np.arange(len(reports)), lambda k: str(k).encode())


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("size", [7, SAMPLES])
def test_the_compiled_check_equals_the_reference(seed: int, size: int) -> None:
    generator = np.random.Generator(np.random.PCG64(seed))
    reports = np.stack(
        [
            1.6e9 + np.cumsum(generator.choice([-2.0, 0.0, 1.0, 1.0, 5.0], SAMPLES)),
            47.0 + generator.choice([0.0, 0.001, 0.002, 1.0], SAMPLES),
            8.0 + generator.choice([0.0, 0.001], SAMPLES),
            generator.choice([np.nan, 3.0, 15.0, 230.0], SAMPLES),
        ],
        axis=1,
    )
    address = generator.integers(1, 6, SAMPLES)
    check = ConsistencyCheck("x")
    plain = {number: Plain() for number in range(1, 6)}
    for begin in range(0, SAMPLES, size):
        part = slice(begin, begin + size)
        made = batch(reports[part], address[part])
        expected = [
            plain[number].stands(*row)
            for number, row in zip(address[part].tolist(), reports[part].tolist(), strict=True)
        ]
        assert check.push(made).tolist() == expected
        rejected = [one.place for one in made.rejected]
        assert rejected == [k for k, stands in enumerate(expected) if not stands]
    reported = [each.rejected for each in plain.values()]
    assert check.stale == sum(each.count("stale") for each in reported) > 0
    assert check.repeated == sum(each.count("repeated") for each in reported) > 0
    assert check.backwards == sum(each.backwards for each in plain.values()) > 0
    assert check.jumps == sum(each.jumps for each in plain.values()) > 0


def test_aircraft_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("multiradar_converters.adsb.consistency.AIRCRAFT_MAX", 3)
    reports = np.tile([1.6e9, 47.0, 8.0, 200.0], (4, 1))
    check = ConsistencyCheck("x")
    assert check.push(batch(reports[:3], np.array([1, 2, 3]))).all()
    with pytest.raises(LayoutError, match="expected at most 3 aircraft"):
        check.push(batch(reports[:1], np.array([4])))


def test_many_aircraft_keep_their_state() -> None:
    count = 3000
    reports = np.tile([1.6e9, 47.0, 8.0, 200.0], (count, 1))
    check = ConsistencyCheck("x")
    assert check.push(batch(reports, np.arange(1, count + 1))).all()
    assert not check.push(batch(reports, np.arange(1, count + 1))).any()
