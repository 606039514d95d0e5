"""Acceptance of records: both forms agree on the bounds."""

import numpy as np
import pytest

from multiradar_converters.adsb.reading import plain, roles
from multiradar_converters.adsb.reading.layout import lay_out
from multiradar_converters.adsb.reading.plain import Row
from multiradar_converters.vid.text.lines import RejectedError

BEGIN_S = 1_533_110_400.0
LAYOUT = lay_out(
    "file",
    ["time_s", "lat", "lon", "icao24", "altitude_m", "geoaltitude_m", "last_position"],
    {"time_s": [f"{BEGIN_S}"] * 3, "last_position": [f"{BEGIN_S}"] * 3},
)


def evaluated(role: int, value: float) -> tuple[bool, str | None]:
    """Return whether a record with this value is accepted, and its error."""
    numbers = [plain.NAN] * roles.NUMBERS
    for known, number in ((roles.TIME, BEGIN_S), (roles.LATITUDE, 47.0), (roles.LONGITUDE, 8.0)):
        numbers[known] = number
    words = [roles.ABSENT] * roles.WORDS
    words[roles.ADDRESS - roles.FIRST_WORD] = 0x3C660C
    if role < roles.FIRST_WORD:
        numbers[role] = value
    else:
        words[role - roles.FIRST_WORD] = int(value)
    fault = plain.fault_of(Row(tuple(numbers), tuple(words)), LAYOUT)
    good = plain.possible(np.array(numbers)[:, None], np.array(words)[:, None], LAYOUT)
    return bool(good[0]), None if fault is None else fault.reason


@pytest.mark.parametrize(
    ("text", "second"),
    [("23:59:60", 0.0), ("23:59:60.5Z", 0.5), ("23:59:59", -1.0), ("22:59:60-01:00", 0.0)],
)
def test_a_leap_second_is_read(text: str, second: float) -> None:
    assert plain._moment(f"2016-12-31T{text}", "time") == 1_483_228_800.0 + second


@pytest.mark.parametrize("text", ["23:59:61", "24:00:00", "23:60:00"])
def test_other_times_of_day_do_not_exist(text: str) -> None:
    with pytest.raises(RejectedError, match="expected a valid date and time"):
        plain._moment(f"2016-12-31T{text}", "time")


@pytest.mark.parametrize(
    ("role", "low", "high"),
    [
        (roles.LATITUDE, -90.0, 90.0),
        (roles.LONGITUDE, -180.0, 180.0),
        (roles.HEIGHT, -1000.0, 40_000.0),
        (roles.GEOMETRIC, -1000.0, 40_000.0),
        (roles.POSITION_TIME, BEGIN_S - 3600.0, BEGIN_S + 60.0),
        (roles.ADDRESS, 1, 0xFFFFFE),
    ],
)
def test_the_bounds_themselves_are_taken_and_what_lies_beyond_is_not(
    role: int, low: float, high: float
) -> None:
    for value in (low, high):
        assert evaluated(role, value) == (True, None)
    whole = role >= roles.FIRST_WORD
    below, above = (
        (low - 1, high + 1) if whole else (np.nextafter(low, -np.inf), np.nextafter(high, np.inf))
    )
    for value in (below, above):
        good, reason = evaluated(role, value)
        assert not good
        assert reason is not None
        assert reason.startswith(LAYOUT.name_of(role))


@pytest.mark.parametrize(
    ("text", "on_ground"),
    [("1", 1), ("0", 0), ("true", 1), ("True", 1), ("false", 0), ("False", 0), ("yes", None)],
)
def test_the_forms_of_true_and_false(text: str, on_ground: int | None) -> None:
    if on_ground is None:
        with pytest.raises(RejectedError, match="expected true or false, was 'yes'"):
            plain.read_cells({roles.GROUND: text}, LAYOUT)
    else:
        row = plain.read_cells({roles.GROUND: text}, LAYOUT)
        assert row.words[roles.GROUND - roles.FIRST_WORD] == on_ground


def test_numbers_of_a_spreadsheet_are_explained() -> None:
    with pytest.raises(RejectedError, match=r"lat: .*, was '46,25' \(a decimal comma; write"):
        plain.read_cells({roles.LATITUDE: "46,25"}, LAYOUT)
    with pytest.raises(RejectedError, match=r"altitude_m: .*, was '10,668' \(.*\)$"):
        plain.read_cells({roles.HEIGHT: "10,668"}, LAYOUT)
    with pytest.raises(RejectedError, match=r"lat: expected a number, was 'north'$"):
        plain.read_cells({roles.LATITUDE: "north"}, LAYOUT)
