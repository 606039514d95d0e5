"""Dates of the text forms are those of the Gregorian calendar."""

import calendar
import datetime as dt

import pytest

from multiradar_converters.vid.text._value_kernels import days_from_civil
from support.kernels import plain


@pytest.mark.parametrize("year", [1900, 1970, 1995, 1999, 2000, 2001, 2018, 2024, 2100, 2399, 2400])
def test_days_are_counted_from_1970(year: int) -> None:
    begin = dt.date(1970, 1, 1)
    for month in range(1, 13):
        for day in (1, calendar.monthrange(year, month)[1]):
            expected = (dt.date(year, month, day) - begin).days
            assert plain(days_from_civil)(year, month, day) == expected
