"""Times of one source in another unit, and what is no gap."""

import pytest

from multiradar.diagnosis.evidence import Source
from multiradar.diagnosis.times import check_gaps, check_times

START_S = 1_533_110_400.0


def source(first_s: float, last_s: float, gap_s: float = 0.0) -> Source:
    made = Source()
    made.first_s, made.last_s, made.read = first_s, last_s, 100
    made.gap_s, made.gap_from_s = gap_s, first_s
    return made


@pytest.mark.parametrize(
    ("factor", "unit"), [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")]
)
def test_times_of_one_source_in_another_unit_are_named(factor: float, unit: str) -> None:
    sources = {name: source(START_S, START_S + 1800.0) for name in ("a", "b")}
    sources["c"] = source(factor * START_S, factor * (START_S + 1800.0))
    (found,) = check_times(sources)
    assert found.sentence.startswith(f"c: its times are probably in {unit}: ")


@pytest.mark.parametrize(("start_s", "found"), [(START_S, 1), (1e3 * START_S, 0)])
def test_times_in_another_unit_have_no_gaps_in_hours(start_s: float, found: int) -> None:
    assert len(check_gaps({"a": source(start_s, start_s + 2e5, gap_s=1e5)})) == found
