"""Errors among the findings end a command; the rest are warnings of this package."""

import pytest

from multiradar.diagnosis.model import Diagnosis
from multiradar.errors import DataWarning
from multiradar.toolbox.diagnoses import findings_of


def test_errors_are_returned_and_the_rest_are_warnings() -> None:
    found = [
        Diagnosis("41-10", "range_unit", "41-10: ranges are probably in km"),
        Diagnosis("", "time_span", "the recording is short", "warning"),
        Diagnosis("33-10", "site", "33-10: the site is probably wrong"),
    ]
    with pytest.warns(DataWarning) as warned:
        errors = findings_of(found)
    assert errors == [found[0].sentence, found[2].sentence]
    assert [str(one.message) for one in warned] == [found[1].sentence]
