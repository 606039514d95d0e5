"""The catalogue fills in the options of a study, and drops unsupported ones."""

import math
import re

import pytest

from multiradar.errors import ArgumentError, UnknownFilterError
from multiradar.research.studies.catalogue import STUDIES
from multiradar.research.studies.result import StudyOptions
from support.fakes.fake_study import ENTRY, FIXED
from support.paths import ROOT

DOCUMENT = ROOT / "docs" / "validation" / "studies.md"


def test_defaults_are_those_of_the_study() -> None:
    assert ENTRY.complete(StudyOptions(seed=4)) == StudyOptions(3, 4, ENTRY.filters, 10.0)
    chosen = StudyOptions(1, 2, ("ci",), 0.5)
    assert ENTRY.complete(chosen) == chosen


def test_unsupported_options_are_dropped() -> None:
    assert FIXED.supported_options == ("seed",)
    assert FIXED.complete(StudyOptions(5, 2, ("no such",), 9.0)) == StudyOptions(seed=2)


def test_an_unsupported_filter_is_reported_with_the_supported_ones() -> None:
    with pytest.raises(
        UnknownFilterError, match=r"unknown filter 'kalman'; known: joint, two-stage, ci"
    ):
        ENTRY.complete(StudyOptions(filters=("ci", "kalman")))


@pytest.mark.parametrize("name", [name for name, entry in STUDIES.items() if entry.duration_s])
def test_durations_of_a_study_are_bounded(name: str) -> None:
    entry = STUDIES[name]
    least, most = entry.duration_bounds_s
    assert least < (entry.duration_s or 0.0) < most
    for duration_s in (least, most):
        assert entry.complete(StudyOptions(duration_s=duration_s)).duration_s == duration_s
    for wrong in (least * 0.99, most * 1.01, math.nan):
        expected = f"`duration_s` of {name}: expected {least:g} to {most:g} s, was {wrong:g} s"
        with pytest.raises(ArgumentError, match=re.escape(expected)):
            entry.complete(StudyOptions(duration_s=wrong))


def test_every_study_has_a_purpose_of_one_sentence() -> None:
    for name, entry in STUDIES.items():
        assert entry.name == name
        assert re.fullmatch(r"[A-Z][^\n]*\.", entry.purpose)
        assert f"<!-- end of {name} -->" in DOCUMENT.read_text(encoding="utf-8")
