"""Figures for people and programs end where they say nothing any more."""

import math

import pytest
from pydantic import JsonValue

from multiradar_schemas.report import Counts, Report
from multiradar_schemas.rounding import rounded


@pytest.mark.parametrize(
    ("value", "short"),
    [
        (184.09999999999997, 184.1),
        (123456789.987, 123456790.0),
        (0.000123456789, 0.000123457),
        (-0.0, 0.0),
        (17, 17),
        (True, True),
        (None, None),
        ("184.09999999999997", "184.09999999999997"),
        ([0.1234567, {"share": 0.7654321987}], [0.123457, {"share": 0.765432}]),
    ],
)
def test_a_number_has_six_digits(value: JsonValue, short: JsonValue) -> None:
    assert rounded(value) == short


def test_an_estimate_ends_with_its_sigma() -> None:
    bias: JsonValue = {"estimate": 184.1167171283, "sigma": 0.71462218382, "true": 185.0}
    assert rounded(bias) == {"estimate": 184.117, "sigma": 0.714622, "true": 185.0}
    small: JsonValue = {"estimate": -0.190154853116, "sigma": 0.000767966877}
    assert rounded(small) == {"estimate": -0.190155, "sigma": 0.000767967}
    below_one: JsonValue = {"estimate": 1234.56789, "sigma": 0.5}
    assert rounded(below_one) == {"estimate": 1234.568, "sigma": 0.5}
    wide: JsonValue = {"estimate": 1234.56, "sigma": 54321.0}
    assert rounded(wide) == {"estimate": 1235.0, "sigma": 54321.0}


@pytest.mark.parametrize("sigma", [0.0, math.inf, None])
def test_an_estimate_without_a_usable_sigma_has_six_digits(sigma: JsonValue) -> None:
    value: JsonValue = {"estimate": 1.23456789, "sigma": sigma}
    assert rounded(value) == {"estimate": 1.23457, "sigma": sigma}


def test_times_and_positions_keep_what_they_need() -> None:
    value: JsonValue = {
        "time_s": 1533112199.3030003, "last_jump_s": 1533112199.1234567,
        "latitude_deg": 47.00525857884747, "longitude_deg": -9.19933614121751,
    }  # fmt: skip
    assert rounded(value) == {
        "time_s": 1533112199.303, "last_jump_s": 1533112199.123457,
        "latitude_deg": 47.00525858, "longitude_deg": -9.19933614,
    }  # fmt: skip


def test_what_is_not_finite_stays() -> None:
    assert rounded({"estimate": math.inf, "sigma": 1.0}) == {"estimate": math.inf, "sigma": 1.0}
    reported = rounded([math.nan])
    assert isinstance(reported, list)
    assert math.isnan(reported[0])


def test_the_figures_of_every_report_are_rounded_and_its_settings_are_not() -> None:
    report = Report(
        command="track", version="1", counts=Counts(read=0, accepted=0, rejected=0),
        rejected_by_code={}, inputs=[], outputs=[],
        settings={"density": 1.23456789},
        figures={"health": {"ratio": 1.1841496496060946}},
    )  # fmt: skip
    assert report.figures == {"health": {"ratio": 1.18415}}
    assert report.settings == {"density": 1.23456789}
    assert Report.model_validate_json(report.model_dump_json()) == report
